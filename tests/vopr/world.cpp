#include "tests/vopr/world.h"

#include <dlfcn.h>
#include <linux/futex.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <map>
#include <memory>
#include <queue>
#include <unordered_map>
#include <vector>

#include "tests/vopr/threads_private.h"

// void strandcast_vopr_switch(void** kept, void* next, uintptr_t next_thread_data): goes on on another stack,
// with the thread_local data of another thread (register FS: arch_prctl(ARCH_SET_FS)).
asm(R"(
.text
.globl strandcast_vopr_switch
.type strandcast_vopr_switch, @function
strandcast_vopr_switch:
  push %rbp
  push %rbx
  push %r12
  push %r13
  push %r14
  push %r15
  sub $8, %rsp
  stmxcsr (%rsp)
  fnstcw 4(%rsp)
  mov %rsp, (%rdi)
  mov %rsi, %rsp
  mov %rdx, %rsi
  mov $0x1002, %edi
  mov $158, %eax
  syscall
  ldmxcsr (%rsp)
  fldcw 4(%rsp)
  add $8, %rsp
  pop %r15
  pop %r14
  pop %r13
  pop %r12
  pop %rbx
  pop %rbp
  ret
.size strandcast_vopr_switch, .-strandcast_vopr_switch
)");
extern "C" void strandcast_vopr_switch(void** kept, void* next, uintptr_t next_thread_data);

namespace strandcast::vopr {

uint32_t Random::next() {
  const uint64_t old = state_;
  state_ = old * 6364136223846793005ull + 1442695040888963407ull;
  const auto mixed = static_cast<uint32_t>(((old >> 18) ^ old) >> 27);
  const auto turn = static_cast<uint32_t>(old >> 59);
  return (mixed >> turn) | (mixed << ((32 - turn) & 31));
}

int64_t Random::between(int64_t low, int64_t high) {
  const auto range = static_cast<uint64_t>(high - low) + 1;
  const uint64_t wide = (uint64_t{next()} << 32) | next();
  return low + static_cast<int64_t>(range == 0 ? wide : wide % range);
}

namespace world {
namespace {

constexpr int64_t kBeginNs = 1'000 * kS;
constexpr int64_t kTimeOfDayNs = 1'767'225'600 * kS;  // 1 January 2026
constexpr int64_t kReadNs = 50;  // that looking at a clock takes, so that no loop waits for ever
constexpr size_t kKeptNotes = 200;
constexpr uint64_t kMostSwitches =
    20'000'000;  // without a millisecond's progress: somebody turns in a circle
constexpr uint32_t kYieldOneIn = 200;
constexpr size_t kStackBytes = 1u << 20;
constexpr size_t kLentStackBytes = 256u << 10;  // of the C library's thread, thread_local data included

/// Runs on a stack of its own, on the one thread of the kernel's that there is. The C library's own thread
/// only lends its thread_local data, and ends them.
struct Thread {
  enum class State { Ready, Waiting, Over };
  uint32_t number = 0;
  NodeId node = kFate;
  State state = State::Ready;
  void* stack = nullptr;         // where it goes on
  char* stack_memory = nullptr;  // null: of the kernel's
  uintptr_t thread_data = 0;
  std::atomic<uint32_t> has_begun{0}, may_end{0}, has_ended{0};  // of the C library's thread
  void* result = nullptr;
  const void* object = nullptr;  // that it waits for
  uint64_t wait_number = 0;
  bool is_woken = false;
  void* (*run)(void*) = nullptr;
  void* argument = nullptr;
  int endings = 0;
};

struct Event {
  int64_t time_ns = 0;
  uint64_t number = 0;
  Thread* thread = nullptr;
  uint64_t wait_number = 0;
  std::function<void()> work = {};
  bool operator<(const Event& other) const {
    return time_ns != other.time_ns ? time_ns > other.time_ns : number > other.number;
  }
};

struct Machine {
  int64_t begin_ns = 0, drift_ppm = 0, jumped_ns = 0;
  bool stands_still = false;
  std::vector<Thread*> held;
};

struct State {
  int64_t time_ns = kBeginNs;
  uint64_t switches = 0, counted_switches = 0, numbers = 0;
  int64_t counted_ns = 0;
  Random random{1};
  std::vector<Event> events;  // a heap
  std::vector<Thread*> ready;
  std::unordered_map<const void*, std::vector<Thread*>> waiting;
  std::map<NodeId, Machine> machines;
  std::unordered_map<pthread_t, Thread*> threads;
  std::deque<std::unique_ptr<Thread>> all;
  std::vector<char*> free_stacks;
  std::array<std::string, kKeptNotes> notes;
  uint64_t note_count = 0;
  uint64_t digest = 14695981039346656037ull;
  std::string title;
  pthread_key_t end_key{};
  Thread main;
};

State& state() {
  static State* const kept = new State;  // also for what runs before and behind main()
  return *kept;
}

thread_local Thread* own_thread = nullptr;

Thread& self() {
  return own_thread != nullptr ? *own_thread : state().main;
}

long futex(std::atomic<uint32_t>& word, int operation, uint32_t value) {
  static const auto call = real<long (*)(long, ...)>("syscall");
  return call(SYS_futex, &word, operation, value, nullptr, nullptr, 0);
}

void set(std::atomic<uint32_t>& word) {
  word = 1;
  futex(word, FUTEX_WAKE_PRIVATE, 1);
}
void await(std::atomic<uint32_t>& word) {
  while (word == 0) futex(word, FUTEX_WAIT_PRIVATE, 0);
}

void push(Event event) {
  State& all = state();
  event.number = ++all.numbers;
  all.events.push_back(std::move(event));
  std::push_heap(all.events.begin(), all.events.end());
}

void leave_queue(Thread& thread) {
  const auto found = state().waiting.find(thread.object);
  if (found == state().waiting.end()) return;
  std::erase(found->second, &thread);
  if (found->second.empty()) state().waiting.erase(found);
}

void make_ready(Thread& thread, bool is_woken) {
  thread.state = Thread::State::Ready;
  thread.is_woken = is_woken;
  ++thread.wait_number;
  Machine& machine = state().machines[thread.node];
  (machine.stands_still ? machine.held : state().ready).push_back(&thread);
}

void run_event() {
  State& all = state();
  std::pop_heap(all.events.begin(), all.events.end());
  Event event = std::move(all.events.back());
  all.events.pop_back();
  all.time_ns = std::max(all.time_ns, event.time_ns);
  if (event.thread == nullptr) return event.work();
  Thread& thread = *event.thread;
  if (thread.state != Thread::State::Waiting || thread.wait_number != event.wait_number) return;
  leave_queue(thread);
  make_ready(thread, false);
}

void count_switch() {
  State& all = state();
  ++all.switches;
  if (all.time_ns - all.counted_ns >= kMs) {
    all.counted_ns = all.time_ns;
    all.counted_switches = all.switches;
  } else if (all.switches - all.counted_switches > kMostSwitches) {
    fail("threads take turns without end while time stands still");
  }
}

Thread& take_next() {
  State& all = state();
  while (!all.events.empty() && all.events.front().time_ns <= all.time_ns) run_event();
  while (all.ready.empty()) {
    if (all.events.empty()) fail("all threads wait for each other");
    run_event();
  }
  const size_t chosen = all.ready.size() == 1 ? 0 : all.random.below(static_cast<uint32_t>(all.ready.size()));
  Thread* const next = all.ready[chosen];
  all.ready[chosen] = all.ready.back();
  all.ready.pop_back();
  count_switch();
  return *next;
}

/// Whoever calls is ready, waits, or is over.
void run_next() {
  Thread& thread = self();
  Thread& next = take_next();
  if (&next != &thread) strandcast_vopr_switch(&thread.stack, next.stack, next.thread_data);
}

/// Behind the thread's own thread_local objects.
void end_thread_data(void* given) {
  auto* const thread = static_cast<Thread*>(given);
  if (++thread->endings < PTHREAD_DESTRUCTOR_ITERATIONS)
    pthread_setspecific(state().end_key, thread);
  else
    set(thread->has_ended);
}

/// The C library's thread.
void* lend_thread_data(void* given) {
  auto* const thread = static_cast<Thread*>(given);
  own_thread = thread;
  pthread_setspecific(state().end_key, thread);
  set(thread->has_begun);
  await(thread->may_end);
  return thread->result;
}

/// On a stack of its own. While the C library's thread ends its data, nothing else runs.
void run_thread() {
  Thread& thread = self();
  thread.result = thread.run(thread.argument);
  set(thread.may_end);
  await(thread.has_ended);
  thread.state = Thread::State::Over;
  state().free_stacks.push_back(thread.stack_memory);
  wake_all(&thread);
  run_next();
}

/// As strandcast_vopr_switch leaves it: control words, six registers, where to go on, and nowhere to return
/// to.
void make_stack(Thread& thread) {
  std::vector<char*>& free = state().free_stacks;
  if (free.empty()) {
    void* const memory = mmap(nullptr, kStackBytes, PROT_READ | PROT_WRITE,
                              MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (memory == MAP_FAILED) fail("no memory for a stack");
    free.push_back(static_cast<char*>(memory));
  }
  thread.stack_memory = free.back();
  free.pop_back();
  constexpr size_t kWords = 9;  // so that a function begins 8 bytes beside a multiple of 16
  auto* const words = reinterpret_cast<uint64_t*>(thread.stack_memory + kStackBytes) - kWords;
  std::fill_n(words, kWords, 0);
  constexpr uint64_t kControlWords =
      0x0000'037f'0000'1f80;  // System V ABI, AMD64, section 3.4.1: FCW and MXCSR
  words[0] = kControlWords;
  words[7] = reinterpret_cast<uint64_t>(&run_thread);
  thread.stack = words;
}

}  // namespace

void* real_function(const char* name) {
  return dlsym(RTLD_NEXT, name);
}

int start_thread(pthread_t* handle, const pthread_attr_t* attributes, void* (*run)(void*), void* argument) {
  using Create = int (*)(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
  static const auto create = real<Create>("pthread_create");
  State& all = state();
  if (all.all.empty()) {
    pthread_key_create(&all.end_key, end_thread_data);
    all.main.thread_data = pthread_self();
  }
  all.all.push_back(std::make_unique<Thread>());
  Thread& thread = *all.all.back();
  thread.number = static_cast<uint32_t>(all.all.size());
  thread.node = self().node;
  thread.run = run;
  thread.argument = argument;
  pthread_attr_t small;
  if (attributes == nullptr) {
    pthread_attr_init(&small);
    pthread_attr_setstacksize(&small, kLentStackBytes);
    attributes = &small;
  }
  const int error = create(handle, attributes, lend_thread_data, &thread);
  if (error != 0) return error;
  await(thread.has_begun);
  thread.thread_data = *handle;  // glibc on x86-64: its address is in the register FS
  make_stack(thread);
  all.threads[*handle] = &thread;
  make_ready(thread, true);
  return 0;
}

int join_thread(pthread_t handle, void** result) {
  static const auto join = real<int (*)(pthread_t, void**)>("pthread_join");
  State& all = state();
  const auto found = all.threads.find(handle);
  if (found == all.threads.end()) return join(handle, result);
  Thread* const thread = found->second;
  all.threads.erase(found);
  while (thread->state != Thread::State::Over) wait(thread, kNever);
  return join(handle, result);  // its record stays: events that are stale by now name it
}

int detach_thread(pthread_t handle) {
  static const auto detach = real<int (*)(pthread_t)>("pthread_detach");
  state().threads.erase(handle);
  return detach(handle);
}

void begin(uint64_t seed) {
  state().random = Random(seed);
}
int64_t time_ns() {
  return state().time_ns;
}
uint64_t switch_count() {
  return state().switches;
}
Random& random() {
  return state().random;
}
NodeId node() {
  return self().node;
}
void set_node(NodeId node) {
  self().node = node;
}

void stand_still(NodeId node) {
  State& all = state();
  Machine& machine = all.machines[node];
  machine.stands_still = true;
  std::erase_if(all.ready, [&](Thread* thread) {
    if (thread->node == node) machine.held.push_back(thread);
    return thread->node == node;
  });
}

void go_on(NodeId node) {
  Machine& machine = state().machines[node];
  machine.stands_still = false;
  state().ready.insert(state().ready.end(), machine.held.begin(), machine.held.end());
  machine.held.clear();
}

void set_clock(NodeId node, int64_t begin_ns, int64_t drift_ppm) {
  Machine& machine = state().machines[node];
  machine.begin_ns = begin_ns;
  machine.drift_ppm = drift_ppm;
}
void jump(NodeId node, int64_t by_ns) {
  state().machines[node].jumped_ns += by_ns;
}

int64_t monotonic_ns(NodeId node) {
  State& all = state();
  all.time_ns += kReadNs;
  const Machine& machine = all.machines[node];
  const int64_t passed_ns = all.time_ns - kBeginNs;
  return kBeginNs + machine.begin_ns + passed_ns + passed_ns / 1'000'000 * machine.drift_ppm;
}

int64_t time_of_day_ns(NodeId node) {
  const int64_t clock_ns = monotonic_ns(node);
  const Machine& machine = state().machines[node];
  return kTimeOfDayNs + clock_ns - kBeginNs - machine.begin_ns + machine.jumped_ns;
}

int64_t when_monotonic(NodeId node, int64_t clock_ns) {
  const Machine& machine = state().machines[node];
  const int64_t passed_ns = clock_ns - kBeginNs - machine.begin_ns;
  // One more, since the clock is rounded down: nobody wakes too early for ever.
  const int64_t time_ns = passed_ns - passed_ns / (1'000'000 + machine.drift_ppm) * machine.drift_ppm +
                          (machine.drift_ppm != 0 ? kUs : 0);
  return kBeginNs + time_ns;
}

int64_t when_time_of_day(NodeId node, int64_t clock_ns) {
  const Machine& machine = state().machines[node];
  return when_monotonic(node, clock_ns - kTimeOfDayNs + kBeginNs + machine.begin_ns - machine.jumped_ns);
}

void at(int64_t time_ns, std::function<void()> work) {
  push({time_ns, 0, nullptr, 0, std::move(work)});
}

bool wait(const void* object, int64_t until_ns) {
  Thread& thread = self();
  thread.state = Thread::State::Waiting;
  thread.object = object;
  ++thread.wait_number;
  state().waiting[object].push_back(&thread);
  if (until_ns != kNever) push({until_ns, 0, &thread, thread.wait_number});
  run_next();
  return thread.is_woken;
}

void wake_one(const void* object) {
  State& all = state();
  const auto found = all.waiting.find(object);
  if (found == all.waiting.end()) return;
  Thread* const thread = found->second.front();
  leave_queue(*thread);
  make_ready(*thread, true);
}

void wake_all(const void* object) {
  State& all = state();
  const auto found = all.waiting.find(object);
  if (found == all.waiting.end()) return;
  const std::vector<Thread*> threads = std::move(found->second);
  all.waiting.erase(found);
  for (Thread* thread : threads) make_ready(*thread, true);
}

void maybe_yield() {
  if (state().ready.empty() || !state().random.one_in(kYieldOneIn)) return;
  make_ready(self(), true);
  run_next();
}

void sleep_until(int64_t time_ns) {
  int nobody = 0;
  wait(&nobody, std::max(time_ns, state().time_ns));
}

void note(const std::string& line) {
  State& all = state();
  char when[32];
  std::snprintf(when, sizeof(when), "%12.6f ", static_cast<double>(all.time_ns - kBeginNs) * 1e-9);
  std::string& kept = all.notes[all.note_count++ % kKeptNotes];
  kept = when + line;
  for (const char c : kept) all.digest = (all.digest ^ static_cast<unsigned char>(c)) * 1099511628211ull;
}

std::string newest_notes() {
  const State& all = state();
  std::string text;
  for (uint64_t i = all.note_count > kKeptNotes ? all.note_count - kKeptNotes : 0; i < all.note_count; ++i)
    text += all.notes[i % kKeptNotes] + "\n";
  return text;
}

uint64_t digest() {
  return state().digest;
}

void set_failure_title(std::string title) {
  state().title = std::move(title);
}

void fail(const std::string& why) {
  std::string text = newest_notes() + state().title + why + "\n";
  static const auto put = real<ssize_t (*)(int, const void*, size_t)>("write");
  for (size_t done = 0; done < text.size();) {
    const ssize_t size = put(STDOUT_FILENO, text.data() + done, text.size() - done);
    if (size <= 0) break;
    done += static_cast<size_t>(size);
  }
  _exit(1);
}

}  // namespace world
}  // namespace strandcast::vopr
