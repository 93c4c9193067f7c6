// The C library's threads, locks, waiting, clocks and chance, as this program has them: all lead into the
// world.
#include <linux/futex.h>
#include <pthread.h>
#include <sched.h>
#include <sys/random.h>
#include <sys/syscall.h>
#include <sys/sysinfo.h>
#include <sys/time.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <cstdarg>
#include <cstring>
#include <ctime>
#include <random>

#include "tests/vopr/threads_private.h"

#define CALL extern "C" __attribute__((visibility("default")))

namespace {

namespace world = strandcast::vopr::world;
using strandcast::vopr::kNever;
using strandcast::vopr::kS;
using strandcast::vopr::kUs;

int64_t in_ns(const timespec& time) {
  return static_cast<int64_t>(time.tv_sec) * kS + time.tv_nsec;
}
timespec to_timespec(int64_t ns) {
  return {static_cast<time_t>(ns / kS), static_cast<long>(ns % kS)};
}
bool is_time_of_day(clockid_t clock) {
  return clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE;
}
/// When this machine's clock says so.
int64_t when(clockid_t clock, const timespec& time) {
  return is_time_of_day(clock) ? world::when_time_of_day(world::node(), in_ns(time))
                               : world::when_monotonic(world::node(), in_ns(time));
}
int64_t read_clock(clockid_t clock) {
  return is_time_of_day(clock) ? world::time_of_day_ns(world::node()) : world::monotonic_ns(world::node());
}

bool is_recursive(const pthread_mutex_t* mutex) {
  return (mutex->__data.__kind & 3) == PTHREAD_MUTEX_RECURSIVE;
}
int own_number() {
  static thread_local char mark;
  return static_cast<int>(reinterpret_cast<uintptr_t>(&mark) >> 4);
}

// A lock that is free has 0 in __lock; __nusers counts who waits.
int take(pthread_mutex_t* mutex, int64_t until_ns) {
  auto& data = mutex->__data;
  if (is_recursive(mutex) && data.__lock != 0 && data.__owner == own_number()) {
    ++data.__count;
    return 0;
  }
  while (data.__lock != 0) {
    ++data.__nusers;
    const bool is_woken = world::wait(mutex, until_ns);
    --data.__nusers;
    if (!is_woken && data.__lock != 0) return ETIMEDOUT;
  }
  data.__lock = 1;
  data.__owner = own_number();
  data.__count = 1;
  return 0;
}

int leave(pthread_mutex_t* mutex) {
  auto& data = mutex->__data;
  if (--data.__count > 0) return 0;
  data.__count = 0;
  data.__lock = 0;
  data.__owner = 0;
  if (data.__nusers > 0) world::wake_one(mutex);
  return 0;
}

int wait_for(pthread_cond_t* condition, pthread_mutex_t* mutex, int64_t until_ns) {
  const unsigned depth = mutex->__data.__count;
  mutex->__data.__count = 1;
  leave(mutex);
  const bool is_woken = world::wait(condition, until_ns);
  take(mutex, kNever);
  mutex->__data.__count = depth;
  return is_woken ? 0 : ETIMEDOUT;
}

int sleep_for(int64_t ns) {
  world::sleep_until(world::time_ns() + ns);
  return 0;
}

long wait_on_word(const int* word, int operation, int value, const timespec* timeout) {
  if (__atomic_load_n(word, __ATOMIC_SEQ_CST) != value) {
    errno = EAGAIN;
    return -1;
  }
  int64_t until_ns = kNever;
  const bool is_absolute = (operation & FUTEX_CMD_MASK) == FUTEX_WAIT_BITSET;
  if (timeout != nullptr && is_absolute)
    until_ns = when((operation & FUTEX_CLOCK_REALTIME) != 0 ? CLOCK_REALTIME : CLOCK_MONOTONIC, *timeout);
  else if (timeout != nullptr)
    until_ns = world::time_ns() + in_ns(*timeout);
  if (world::wait(word, until_ns)) return 0;
  errno = ETIMEDOUT;
  return -1;
}

}  // namespace

// ---- threads ----

CALL int pthread_create(pthread_t* handle, const pthread_attr_t* attributes, void* (*run)(void*),
                        void* argument) noexcept {
  return world::start_thread(handle, attributes, run, argument);
}
CALL int pthread_join(pthread_t handle, void** result) {
  return world::join_thread(handle, result);
}
CALL int pthread_detach(pthread_t handle) noexcept {
  return world::detach_thread(handle);
}
CALL int sched_yield() noexcept {
  return sleep_for(kUs);
}
CALL int get_nprocs() noexcept {
  return 1;
}

// ---- locks ----

CALL int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
  return take(mutex, kNever);
}
CALL int pthread_mutex_trylock(pthread_mutex_t* mutex) noexcept {
  const bool is_own = is_recursive(mutex) && mutex->__data.__owner == own_number();
  return mutex->__data.__lock != 0 && !is_own ? EBUSY : take(mutex, kNever);
}
CALL int pthread_mutex_timedlock(pthread_mutex_t* mutex, const timespec* time) noexcept {
  return take(mutex, when(CLOCK_REALTIME, *time));
}
CALL int pthread_mutex_clocklock(pthread_mutex_t* mutex, clockid_t clock, const timespec* time) noexcept {
  return take(mutex, when(clock, *time));
}
CALL int pthread_mutex_unlock(pthread_mutex_t* mutex) noexcept {
  leave(mutex);
  world::maybe_yield();
  return 0;
}
CALL int pthread_mutex_destroy(pthread_mutex_t*) noexcept {
  return 0;
}

// Who reads locks like who writes: fewer run at once, and none runs who might not.
CALL int pthread_rwlock_wrlock(pthread_rwlock_t* lock) noexcept {
  auto& data = lock->__data;
  while (data.__readers != 0) {
    ++data.__writers;
    world::wait(lock, kNever);
    --data.__writers;
  }
  data.__readers = ~0u;
  return 0;
}
CALL int pthread_rwlock_rdlock(pthread_rwlock_t* lock) noexcept {
  auto& data = lock->__data;
  while (data.__readers == ~0u) {
    ++data.__writers;
    world::wait(lock, kNever);
    --data.__writers;
  }
  ++data.__readers;
  return 0;
}
CALL int pthread_rwlock_unlock(pthread_rwlock_t* lock) noexcept {
  auto& data = lock->__data;
  data.__readers = data.__readers == ~0u ? 0 : data.__readers - 1;
  if (data.__readers == 0 && data.__writers > 0) world::wake_all(lock);
  return 0;
}
CALL int pthread_rwlock_destroy(pthread_rwlock_t*) noexcept {
  return 0;
}

CALL int pthread_once(pthread_once_t* control, void (*run)()) {
  enum { Fresh, Running, Done };
  while (*control == Running) world::wait(control, kNever);
  if (*control == Done) return 0;
  *control = Running;
  try {
    run();
  } catch (...) {
    *control = Fresh;
    world::wake_all(control);
    throw;
  }
  *control = Done;
  world::wake_all(control);
  return 0;
}

// ---- waiting ----

CALL int pthread_cond_wait(pthread_cond_t* condition, pthread_mutex_t* mutex) {
  return wait_for(condition, mutex, kNever);
}
CALL int pthread_cond_timedwait(pthread_cond_t* condition, pthread_mutex_t* mutex, const timespec* time) {
  return wait_for(condition, mutex, when(CLOCK_REALTIME, *time));
}
CALL int pthread_cond_clockwait(pthread_cond_t* condition, pthread_mutex_t* mutex, clockid_t clock,
                                const timespec* time) {
  return wait_for(condition, mutex, when(clock, *time));
}
CALL int pthread_cond_signal(pthread_cond_t* condition) noexcept {
  world::wake_one(condition);
  return 0;
}
CALL int pthread_cond_broadcast(pthread_cond_t* condition) noexcept {
  world::wake_all(condition);
  return 0;
}
CALL int pthread_cond_destroy(pthread_cond_t*) noexcept {
  return 0;
}

/// What the C++ library asks the kernel for directly: futures, and first uses of static objects.
CALL long syscall(long number, ...) noexcept {
  va_list list;
  va_start(list, number);
  long given[6];
  for (long& one : given) one = va_arg(list, long);
  va_end(list);
  auto* const word = reinterpret_cast<int*>(given[0]);
  if (number == SYS_futex) {
    const int operation = static_cast<int>(given[1]);
    const int command = operation & FUTEX_CMD_MASK;
    if (command == FUTEX_WAIT || command == FUTEX_WAIT_BITSET)
      return wait_on_word(word, operation, static_cast<int>(given[2]), reinterpret_cast<timespec*>(given[3]));
    if (command == FUTEX_WAKE) {
      if (given[2] == 1)
        world::wake_one(word);
      else
        world::wake_all(word);
      return 0;
    }
  }
  static const auto call = world::real<long (*)(long, ...)>("syscall");
  return call(number, given[0], given[1], given[2], given[3], given[4], given[5]);
}

// ---- clocks ----

CALL int clock_gettime(clockid_t clock, timespec* time) noexcept {
  *time = to_timespec(read_clock(clock));
  return 0;
}
CALL int gettimeofday(timeval* time, void*) noexcept {
  const int64_t ns = read_clock(CLOCK_REALTIME);
  *time = {static_cast<time_t>(ns / kS), static_cast<suseconds_t>(ns % kS / kUs)};
  return 0;
}
CALL time_t time(time_t* result) noexcept {
  const auto seconds = static_cast<time_t>(read_clock(CLOCK_REALTIME) / kS);
  if (result != nullptr) *result = seconds;
  return seconds;
}
CALL int nanosleep(const timespec* time, timespec*) {
  return sleep_for(in_ns(*time));
}
CALL int clock_nanosleep(clockid_t clock, int flags, const timespec* time, timespec*) {
  if ((flags & TIMER_ABSTIME) == 0) return sleep_for(in_ns(*time));
  world::sleep_until(when(clock, *time));
  return 0;
}
CALL int usleep(useconds_t us) {
  return sleep_for(int64_t{us} * kUs);
}

// ---- chance ----

CALL ssize_t getrandom(void* buffer, size_t size, unsigned) {
  for (size_t i = 0; i < size; ++i)
    static_cast<unsigned char*>(buffer)[i] = static_cast<unsigned char>(world::random().next());
  return static_cast<ssize_t>(size);
}
std::random_device::result_type std::random_device::_M_getval() {
  return world::random().next();
}
