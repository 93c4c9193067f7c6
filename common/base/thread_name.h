// Sets thread names, which top -H, gdb and tests/bench/idle.sh show.
#pragma once

#ifdef __linux__
#include <pthread.h>
#endif

namespace strandcast {

/// Names the calling thread; at most 15 characters.
inline void name_thread([[maybe_unused]] const char* name) {
#ifdef __linux__
  pthread_setname_np(pthread_self(), name);
#endif
}

}  // namespace strandcast
