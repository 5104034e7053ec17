// A small file dialog.

#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace haarlight::viewer {

/// Lists a folder in a modal window. Errors of the file system are shown in it.
class FileBrowser {
 public:
  using Chosen = std::function<void(const std::filesystem::path&)>;

  /// Shows the dialog for files with one of `suffixes` (with dots, lower case).
  void open(std::string title, std::vector<std::string> suffixes, Chosen chosen);
  /// Draws it while it is open.
  void draw(double scale);
  bool is_open() const { return open_; }

  std::filesystem::path folder;  ///< where it begins; empty: the working folder

 private:
  void list();
  void enter(const std::filesystem::path& place);

  struct Entry {
    std::string name;
    bool is_folder = false;
    std::uintmax_t bytes = 0;
  };
  std::string title_, typed_, problem_;
  std::vector<std::string> suffixes_;
  Chosen chosen_;
  std::vector<Entry> entries_;
  bool open_ = false, appear_ = false;
};

}  // namespace haarlight::viewer
