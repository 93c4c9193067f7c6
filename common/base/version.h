// Version of this build, as programs print it for --version and the server sends it in Welcome. Any thread.
#pragma once

namespace strandcast {

/// Returns the version that project() in CMakeLists.txt states, for example "0.2.0".
const char* version();

}  // namespace strandcast
