// Version of this build: what programs print for --version and what a server tells in its Welcome. Any
// thread.
#pragma once

namespace strandcast {

/// That of project() in CMakeLists.txt, for example "0.2.0".
const char* version();

}  // namespace strandcast
