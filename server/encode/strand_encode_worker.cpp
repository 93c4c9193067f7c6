#include "server/encode/strand_encode_worker.h"

#include <utility>

#include "common/base/log.h"

namespace strandcast {
namespace {

constexpr double kMsPerNs = 1e-6;

}  // namespace

StrandEncodeWorker::StrandEncodeWorker(SnapshotSlot& slot, std::unique_ptr<StrandEncoder> encoder, Sink sink)
    : slot_(slot), encoder_(std::move(encoder)), sink_(std::move(sink)), thread_([this] { run(); }) {}

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
  return view.version != encoded_version_ || is_keyframe_wanted_ || is_restarting_;
}

void StrandEncodeWorker::run() {
  while (true) {
    const SnapshotSlot::View view =
        slot_.wait([this](const SnapshotSlot::View& now) { return has_work(now); });
    if (view.is_stopped || is_stopping_) return;
    if (view.version != encoded_version_) {
      encoded_version_ = view.version;
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
  const EncodedFramePtr frame = encoder_->encode(snapshot);
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
  sink_(with_send_time(frame, now_ns()));
}

}  // namespace strandcast
