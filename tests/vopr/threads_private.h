// Threads of the world, for the calls of the C library that make and join them.
#pragma once

#include <pthread.h>

#include "tests/vopr/world.h"

namespace strandcast::vopr::world {

int start_thread(pthread_t* handle, const pthread_attr_t* attributes, void* (*run)(void*), void* argument);
int join_thread(pthread_t handle, void** result);
int detach_thread(pthread_t handle);

/// The C library's own function of this name, behind ours.
void* real_function(const char* name);
template <class Function>
Function real(const char* name) {
  return reinterpret_cast<Function>(real_function(name));
}

}  // namespace strandcast::vopr::world
