#include "server/encode/strand_encode_worker.h"

#include <utility>

#include "common/base/log.h"

namespace strandcast {
namespace {

constexpr double kMsPerNs = 1e-6;

}  // namespace

Snapshot coarsen(const Snapshot& snapshot, uint32_t factor) {
  Snapshot coarse = snapshot;
  if (factor <= 1) return coarse;
  const auto step = static_cast<int32_t>(factor);
  coarse.quantum_m = snapshot.quantum_m * static_cast<float>(factor);
  for (int32_t& value : coarse.lattice) {
    // To the nearest, rounding down where C++ division rounds to zero.
    const int32_t shifted = value + step / 2;
    value = shifted / step - (shifted % step < 0 ? 1 : 0);
  }
  return coarse;
}

StrandEncodeWorker::StrandEncodeWorker(SnapshotSlot& slot, std::unique_ptr<StrandEncoder> encoder, Sink sink,
                                       StrandEncodeConfig config)
    : slot_(slot), encoder_(std::move(encoder)), sink_(std::move(sink)), config_(config), thread_([this] {
        run();
      }) {}

StrandEncodeWorker::~StrandEncodeWorker() {
  is_stopping_ = true;
  slot_.notify();
  thread_.join();
}

void StrandEncodeWorker::set_has_listeners(bool has_listeners) {
  if (has_listeners && !has_listeners_) is_restarting_ = true;
  has_listeners_ = has_listeners;
  slot_.notify();
}

void StrandEncodeWorker::request_keyframe() {
  is_keyframe_wanted_ = true;
  slot_.notify();
}

StrandEncodeCounters StrandEncodeWorker::counters() const {
  const std::lock_guard lock(counters_mutex_);
  StrandEncodeCounters counters = counters_;
  counters.encode_median_ms = encode_timer_.median_ms();
  counters.keyframe_median_ms = keyframe_timer_.median_ms();
  return counters;
}

bool StrandEncodeWorker::has_work(const SnapshotSlot::View& view) const {
  if (is_stopping_) return true;
  if (!has_listeners_ || view.snapshot == nullptr) return false;
  return is_due(view) || is_keyframe_wanted_ || is_restarting_;
}

/// Whether the newest state is for this class.
bool StrandEncodeWorker::is_due(const SnapshotSlot::View& view) const {
  if (view.version == encoded_version_) return false;
  const uint64_t tick = view.snapshot->tick;
  const bool is_first = encoded_version_ == 0 || is_restarting_;
  // By a fixed grid: a state that is taken late does not put off those that follow.
  return config_.rate_divisor <= 1 || is_first ||
         tick / config_.rate_divisor != encoded_tick_ / config_.rate_divisor;
}

void StrandEncodeWorker::run() {
  const auto is_ready = [this](const SnapshotSlot::View& now) { return has_work(now); };
  while (true) {
    SnapshotSlot::View view;
    bool is_overdue = false;  // no further state comes whose turn it would be
    if (config_.rate_divisor <= 1) {
      view = slot_.wait(is_ready);
    } else {
      view = slot_.wait_for(kLongestStateWait, is_ready);
      is_overdue =
          has_listeners_ && view.snapshot != nullptr && !has_work(view) && view.version != encoded_version_;
    }
    if (view.is_stopped || is_stopping_) return;
    if (!is_overdue && !has_work(view)) continue;
    if (is_overdue || is_due(view)) {
      encoded_version_ = view.version;
      encoded_tick_ = view.snapshot->tick;
      encode_newest(*view.snapshot);
    }
    // Requests up to here are served by one keyframe; later ones wake the thread again.
    const bool is_wanted = is_keyframe_wanted_.exchange(false);
    const bool is_restarting = is_restarting_.exchange(false);
    if (is_wanted || is_restarting) give_keyframe();
  }
}

void StrandEncodeWorker::encode_newest(const Snapshot& snapshot) {
  const int64_t begin_ns = now_ns();
  const EncodedFramePtr frame =
      encoder_->encode(config_.coarsening > 1 ? coarsen(snapshot, config_.coarsening) : snapshot);
  const double encode_ms = static_cast<double>(now_ns() - begin_ns) * kMsPerNs;
  const bool is_keyframe = frame != nullptr && frame->header.opcode == Opcode::StrandKeyframe;
  keyframe_ = is_keyframe ? frame : nullptr;
  bool is_first_too_large = false;
  {
    const std::lock_guard lock(counters_mutex_);
    ++counters_.encodes;
    encode_timer_.add_ms(encode_ms);
    if (frame == nullptr) is_first_too_large = counters_.too_large++ == 0;
    if (frame != nullptr)
      (is_keyframe ? counters_.keyframe_bytes : counters_.delta_bytes) += frame->message.size();
    if (is_keyframe) ++counters_.keyframes;
  }
  if (is_first_too_large)
    log_error("encode", "a snapshot of {} strands x {} vertices does not fit into one message of {} bytes",
              snapshot.strand_count, snapshot.vertex_count, kMaxMediaPayloadBytes);
  // After a pause nobody has what a delta builds on; the keyframe that follows is all they need. A keyframe
  // that is given here serves everyone who waits.
  if (frame == nullptr || (is_restarting_ && !is_keyframe)) return;
  if (is_keyframe) {
    is_keyframe_wanted_ = false;
    is_restarting_ = false;
  }
  give(*frame);
}

void StrandEncodeWorker::give_keyframe() {
  if (keyframe_ == nullptr) {
    const int64_t begin_ns = now_ns();
    keyframe_ = encoder_->encode_keyframe();
    if (keyframe_ == nullptr) return;  // counted as too large by encode_newest
    const std::lock_guard lock(counters_mutex_);
    keyframe_timer_.add_ms(static_cast<double>(now_ns() - begin_ns) * kMsPerNs);
    ++counters_.keyframes;
    counters_.keyframe_bytes += keyframe_->message.size();
  }
  give(*keyframe_);
}

void StrandEncodeWorker::give(const EncodedFrame& frame) {
  sink_(with_send_time(frame, config_.stream_id, now_ns()));
}

}  // namespace strandcast
