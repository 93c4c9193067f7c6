// Instead of the page, where it is not built.
#include "common/page/page_files.h"

namespace strandcast {

PageFiles built_in_page() {
  return {};
}

}  // namespace strandcast
