// What the readers of JSON and CBOR share.
#pragma once

#include "common/motion/value_tree.h"

namespace strandcast {

inline Error tree_error(size_t at_byte, const char* what) {
  return Error{ErrorCode::BadInput, what, fmt::format("byte {}", at_byte)};
}

/// Counts what a document holds, so far.
class TreeBudget {
 public:
  Status take(size_t depth) {
    if (depth > kMaxTreeDepth)
      return make_error(ErrorCode::LimitExceeded, "values lie within each other more than {} deep",
                        kMaxTreeDepth);
    if (++values_ > kMaxTreeValues)
      return make_error(ErrorCode::LimitExceeded, "there are more than {} values", kMaxTreeValues);
    return {};
  }

 private:
  size_t values_ = 0;
};

}  // namespace strandcast
