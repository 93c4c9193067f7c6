#include "common/base/version.h"

namespace strandcast {

const char* version() {
  return STRANDCAST_VERSION;  // by common/base/CMakeLists.txt, for this file alone
}

}  // namespace strandcast
