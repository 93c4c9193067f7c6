// PassList: passes as objects. A list keeps the passes whose output is wanted, prepares and runs them in
// order, and times each; its report shows what it runs. One thread per list. Holds no GL itself.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/profile.h"
#include "common/base/result.h"
#include "common/base/units.h"
#include "common/gl/pass_plan.h"
#include "common/gl/timer.h"

namespace strandcast::gl {

/// Clock that times a pass: that of this thread, or that of the device, which waits until its work is done.
enum class PassClock { Host, Device };

/// One line of the report on passes. A value that may be passed to other threads.
struct PassReport {
  std::string name;
  PassFate fate = PassFate::Kept;
  std::string reason;
  uint64_t size_bytes = 0;  // of what it keeps, and of what it is the first to write
  uint64_t runs = 0;        // since it was made
  double median_ms = 0.0;   // of the last kStageWindow runs; 0 = never run

  bool operator==(const PassReport&) const = default;
};
using PassReports = std::vector<PassReport>;
/// Makes a report line for work outside of any list, which runs on its own thread when input comes.
PassReport make_report(std::string name, PassFate fate, std::string reason, const StageTimer& timer);

/// Common part of all passes: a declaration and a timer.
class PassEntry {
 public:
  explicit PassEntry(PassDeclaration declaration, PassClock clock = PassClock::Device)
      : declaration_(std::move(declaration)), clock_(clock) {}
  virtual ~PassEntry() = default;
  PassEntry(const PassEntry&) = delete;
  PassEntry& operator=(const PassEntry&) = delete;

  const PassDeclaration& declaration() const { return declaration_; }
  PassClock clock() const { return clock_; }
  /// Returns the bytes that a running pass keeps for itself, besides its outputs.
  virtual uint64_t size_bytes() const { return 0; }
  /// Returns whether the pass runs in batches. Successive batched passes run together, repeatedly, until the
  /// turn has no more batches.
  virtual bool is_batched() const { return false; }
  StageTimer& timer() { return timer_; }
  const StageTimer& timer() const { return timer_; }

 private:
  PassDeclaration declaration_;
  PassClock clock_;
  StageTimer timer_;
};

/// Arguments of the passes in one run of their list. Derived types add contents and name a type `Setup`.
struct PassTurn {
  uint32_t batch_index = 0;       // counted by the list
  bool has_more_batches = false;  // set by a batched pass in each run but the last
};

template <class Turn>
class Pass : public PassEntry {
 public:
  using PassEntry::PassEntry;
  /// Prepares a pass that will run, once before its first run: compiles and allocates what it needs and
  /// writes.
  virtual Status prepare(const typename Turn::Setup&) { return {}; }
  virtual Status run(Turn& turn) = 0;
};

/// Part of a list that does not depend on the arguments of its passes.
class PassListBase {
 public:
  /// Decides which passes run, for the wanted outputs. After an error the previous decision stays.
  Status plan(const Resources& external, const Resources& wanted);
  const PassPlan& plan() const { return plan_; }
  bool runs(std::string_view pass) const { return plan_.runs(pass); }
  /// Returns a line for every pass in order, including those that do not run.
  PassReports report() const;
  /// Returns the duration of one pass in the last run, all batches together; 0 if it did not run.
  double last_ms(std::string_view pass) const;
  /// Returns the duration of all passes in the last run.
  double last_total_ms() const;
  /// Bytes of the live resources and of running passes, and bytes saved by the others. Targets count from
  /// their first run on, when they get their size.
  uint64_t live_bytes() const;
  uint64_t saved_bytes() const;

 protected:
  struct Slot {
    PassEntry* entry = nullptr;
    bool is_kept = false;
    bool is_prepared = false;
    double last_ms = 0.0;
  };
  /// Times one run of `work`; `device` times the GPU work of `slot`.
  template <class Work>
  Status run_timed(Slot& slot, GpuTimer* device, Work&& work);
  void begin_run();
  void end_run();

  std::vector<Slot> slots_;

 private:
  uint64_t bytes(bool is_live) const;
  PassPlan plan_;
  Resources external_;
};

template <class Turn>
class PassList : public PassListBase {
 public:
  using Setup = typename Turn::Setup;

  void add(std::unique_ptr<Pass<Turn>> pass) {
    slots_.push_back({pass.get()});
    passes_.push_back(std::move(pass));
  }
  /// Keeps a resource for as long as the passes that share it.
  template <class T>
  T& keep(std::unique_ptr<T> resource) {
    T& kept = *resource;
    resources_.push_back(std::move(resource));
    return kept;
  }
  /// Prepares the passes that run and are not prepared yet.
  Status prepare(const Setup& setup) {
    for (size_t i = 0; i < slots_.size(); ++i) {
      if (!slots_[i].is_kept || slots_[i].is_prepared) continue;
      RETURN_IF_ERROR(passes_[i]->prepare(setup));
      slots_[i].is_prepared = true;
    }
    return {};
  }
  /// Runs the kept passes in order; the first error ends the run. `device` may be null if no kept pass is
  /// timed by the device.
  Status run(Turn& turn, GpuTimer* device) {
    begin_run();
    for (size_t begin = 0; begin < slots_.size();) {
      const size_t end = end_of_batch(begin);
      turn.batch_index = 0;
      do {
        turn.has_more_batches = false;
        for (size_t i = begin; i < end; ++i)
          if (slots_[i].is_kept)
            RETURN_IF_ERROR(run_timed(slots_[i], device, [&] { return passes_[i]->run(turn); }));
        ++turn.batch_index;
      } while (turn.has_more_batches);
      begin = end;
    }
    end_run();
    return {};
  }

 private:
  size_t end_of_batch(size_t begin) const {
    size_t end = begin;
    while (end < slots_.size() && passes_[end]->is_batched()) ++end;
    return std::max(end, begin + 1);
  }

  std::vector<std::unique_ptr<Resource>> resources_;  // before the passes that refer to them
  std::vector<std::unique_ptr<Pass<Turn>>> passes_;
};

template <class Work>
Status PassListBase::run_timed(Slot& slot, GpuTimer* device, Work&& work) {
  if (slot.entry->clock() == PassClock::Device && device != nullptr) {
    device->begin();
    Status status = work();
    slot.last_ms += device->end_ms();
    return status;
  }
  const int64_t begin_ns = now_ns();
  Status status = work();
  slot.last_ms += static_cast<double>(now_ns() - begin_ns) * kMsPerNs;
  return status;
}

}  // namespace strandcast::gl
