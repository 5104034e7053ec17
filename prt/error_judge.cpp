// Which judge is for which transport.

#include "prt/error_judge.h"

#include "prt/error_estimator.h"
#include "prt/view_error_estimator.h"

namespace haarlight {

std::unique_ptr<ErrorJudge> make_error_judge(const Transport& transport) {
  if (ErrorEstimator::fits(transport)) return std::make_unique<ErrorEstimator>(transport);
  return std::make_unique<ViewErrorEstimator>(transport);
}

}  // namespace haarlight
