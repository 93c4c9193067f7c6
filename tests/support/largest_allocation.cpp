#include "tests/support/largest_allocation.h"

#include <atomic>
#include <cstdlib>
#include <new>

namespace {
std::atomic<size_t> largest_bytes{0};
}  // namespace

void* operator new(size_t size) {
  size_t seen = largest_bytes.load();
  while (size > seen && !largest_bytes.compare_exchange_weak(seen, size)) {
  }
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, size_t) noexcept {
  std::free(memory);
}

namespace strandcast::test {

void reset_largest_allocation() {
  largest_bytes = 0;
}
size_t largest_allocation_bytes() {
  return largest_bytes;
}

}  // namespace strandcast::test
