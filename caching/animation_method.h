// What every way of drawing a scene that moves does: a picture and figures a frame.

#pragma once

#include <string>
#include <vector>

#include "core/image.h"
#include "core/progress.h"

namespace haarlight {

/// One frame as a method has drawn it. A plain value.
struct FramePicture {
  struct Extra {
    std::string name;  ///< such as "life"
    Image picture;     ///< display-referred, linear in [0, 1]: to be looked at
  };
  Image radiance;
  std::vector<double> figure;  ///< one for each of AnimationMethod::figures()
  std::vector<Extra> extra;
};

/// Draws the frames of one scene. Not safe to use from two threads at once; works with as many as
/// parallel_for has, to the same bits.
class AnimationMethod {
 public:
  virtual ~AnimationMethod() = default;

  /// What FramePicture::figure holds, with units, as columns of a table: "records_new", "rays".
  virtual std::vector<std::string> figures() const = 0;
  /// Work before the first frame, for `count` frames from `first` on. Does nothing unless a method
  /// needs it. Throws as frame().
  virtual void prepare(int first, int count, const Progress& progress) {
    static_cast<void>(first), static_cast<void>(count), static_cast<void>(progress);
  }
  /// What share of all work prepare() is, about; [0, 1).
  virtual double prepare_share() const { return 0; }
  /// Frames are asked for once each, in ascending order, between those of prepare(). Throws
  /// Error{cancelled} when told to stop, Error{missing} without a camera.
  virtual FramePicture frame(int number, const Progress& progress) = 0;
};

}  // namespace haarlight
