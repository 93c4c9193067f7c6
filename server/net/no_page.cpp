// Instead of the page, where it is not built.
#include "server/net/page.h"

namespace strandcast {

PageFiles built_in_page() {
  return {};
}

}  // namespace strandcast
