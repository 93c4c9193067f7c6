#include "server/encode/strand_encode_worker.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

#include "common/base/thread_name.h"
#include "common/base/units.h"
#include "common/log/log.h"
#include "common/strands/shared_strands.h"
#include "common/strands/strand_prefix.h"

namespace strandcast {
namespace {

constexpr std::chrono::milliseconds kKeyframePatience{
    50};  // for a new state, before the present one is encoded again

/// Simulated time in which joiners share a keyframe whose state everybody takes over: each moves the hair.
constexpr int64_t kToldNs = 500'000'000;

/// Returns whether the slot has a snapshot with the lattice step that the class announces.
bool has_state(const SnapshotSlot::View& view, const StrandEncodeConfig& config) {
  if (view.snapshot == nullptr) return false;
  return config.quantum_m == 0.0f || view.snapshot->quantum_m == config.quantum_m;
}

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
                                       StrandEncodeConfig config, SharedSlot* shared)
    : slot_(slot),
      encoder_(std::move(encoder)),
      sink_(std::move(sink)),
      shared_(shared),
      stream_id_(config.stream_id),
      config_(config),
      thread_([this] { run(); }) {}

StrandEncodeWorker::~StrandEncodeWorker() {
  is_stopping_ = true;
  slot_.notify();
  thread_.join();
  if (shared_ != nullptr) shared_->set_followed(false);
}

void StrandEncodeWorker::set_listeners(StrandListeners listeners) {
  if (listeners != StrandListeners::None && !has_listeners()) {
    restart_version_ = slot_.latest().version;
    is_restarting_ = true;
  }
  listeners_ = listeners;
  say_followed();
  slot_.notify();
}

void StrandEncodeWorker::request_state(int64_t not_before_ns) {
  const bool is_first = !has_request();
  state_wanted_ns_ = is_first ? not_before_ns : std::min(not_before_ns, state_wanted_ns_.load());
  ++state_requests_;
  slot_.notify();
}

void StrandEncodeWorker::change(const StrandEncodeConfig& config) {
  {
    const std::lock_guard lock(config_mutex_);
    config_ = config;
  }
  say_followed();
  slot_.notify();
}

void StrandEncodeWorker::say_followed() const {
  if (shared_ != nullptr)
    shared_->set_followed(listeners_ == StrandListeners::All && config().rate_divisor <= 1);
}

StrandEncodeConfig StrandEncodeWorker::config() const {
  const std::lock_guard lock(config_mutex_);
  return config_;
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

gl::PassReport strand_encode_report(uint16_t stream_id, bool has_listeners, const StageTimer& timer) {
  return gl::make_report(stream_id == 0 ? "encode/strands" : fmt::format("encode/strands_{}", stream_id),
                         has_listeners ? gl::PassFate::Kept : gl::PassFate::Unread,
                         has_listeners ? "writes strand frames for its readers" : "nobody reads its frames",
                         timer);
}

gl::PassReport StrandEncodeWorker::pass() const {
  const std::lock_guard lock(counters_mutex_);
  return strand_encode_report(stream_id_, has_listeners(), encode_timer_);
}

bool StrandEncodeWorker::has_work(const SnapshotSlot::View& view) const {
  if (is_stopping_) return true;
  if (!has_listeners() || !has_state(view, config())) return false;
  // A state from before anybody listened may be old: a new one comes soon, unless the server is paused.
  if (is_restarting_ && view.version == restart_version_) return false;
  return is_due(view) || is_restarting_ || (is_keyframe_wanted_ && keyframe_ != nullptr);
}

/// Whether the newest state is for this class.
bool StrandEncodeWorker::is_due(const SnapshotSlot::View& view) const {
  if (view.version == encoded_version_) return false;
  const uint64_t tick = view.snapshot->tick;
  const uint32_t rate_divisor = config().rate_divisor;
  const bool is_first = encoded_version_ == 0 || is_restarting_;
  if (listeners_ == StrandListeners::OnRequest)
    return is_first || is_keyframe_wanted_ || (has_request() && now_ns() >= state_wanted_ns_);
  // By a fixed grid: a state that is taken late does not put off those that follow.
  return rate_divisor <= 1 || is_first || tick / rate_divisor != encoded_tick_ / rate_divisor;
}

/// Returns for a new state, or when somebody has waited long enough for a keyframe of the present one.
SnapshotSlot::View StrandEncodeWorker::wait_for_work() const {
  const bool is_on_request = listeners_ == StrandListeners::OnRequest;
  const bool had_request = has_request();
  const int64_t wanted_ns = state_wanted_ns_;
  const int64_t request_wait_ns = had_request ? wanted_ns - now_ns() : 0;
  const auto has_work_now = [this](const SnapshotSlot::View& now) { return has_work(now); };
  const auto has_news = [&](const SnapshotSlot::View& now) {
    // Whose time decides when to wake.
    const bool is_asked = is_on_request && has_request() && (!had_request || state_wanted_ns_ != wanted_ns);
    return has_work(now) || is_asked ||
           (has_listeners() && has_state(now, config()) && (is_keyframe_wanted_ || is_restarting_));
  };
  if (is_on_request && request_wait_ns > 0)
    (void)slot_.wait_for(std::chrono::nanoseconds(request_wait_ns), has_news);
  else if (is_on_request || config().rate_divisor <= 1)
    (void)slot_.wait(has_news);
  else
    (void)slot_.wait_for(kLongestStateWait, has_news);
  return slot_.wait_for(
      is_keyframe_wanted_ || is_restarting_ ? kKeyframePatience : std::chrono::milliseconds(0), has_work_now);
}

void StrandEncodeWorker::run() {
  name_thread("encode");
  while (true) {
    const SnapshotSlot::View view = wait_for_work();
    if (view.is_stopped || is_stopping_) return;
    const StrandEncodeConfig config_now = config();
    if (has_listeners() && has_state(view, config_now)) serve(view, config_now);
    if (shared_ != nullptr && view.snapshot != nullptr) shared_->set_encoded(view.snapshot->tick);
  }
}

void StrandEncodeWorker::serve(const SnapshotSlot::View& view, const StrandEncodeConfig& config) {
  // Without work there was a long wait: no further state comes whose turn it would be.
  const bool is_overdue =
      listeners_ == StrandListeners::All && !has_work(view) && view.version != encoded_version_;
  const bool is_new = is_due(view) || is_overdue;
  // Requests up to here are served by one keyframe; later ones wake the thread again.
  const int64_t since_told_ns = view.snapshot->sim_time_ns - told_ns_.value_or(0);
  const bool is_early = is_new && told_ns_ && since_told_ns >= 0 && since_told_ns < kToldNs;
  const bool is_wanted = !is_early && is_keyframe_wanted_.exchange(false);
  const bool is_restarting = is_restarting_.exchange(false);
  if (!is_new && keyframe_ != nullptr) {
    if (is_wanted || is_restarting) give(keyframe_);
    return;
  }
  if (!is_new && !is_wanted && !is_restarting) return;
  encoded_version_ = view.version;
  encoded_tick_ = view.snapshot->tick;
  const Audience audience = is_wanted || is_restarting ? Audience::Joiners : Audience::Followers;
  const uint64_t requests = state_requests_;
  const JoinFrames frames = encode(*view.snapshot, config, audience);
  if (frames.frame != nullptr) answered_requests_ = requests;
  keyframe_ = frames.keyframe;
  // After a pause nobody has what a delta builds on; the keyframe is all they need.
  if (frames.frame != frames.keyframe && !is_restarting) give(frames.frame);
  give(frames.keyframe);
}

JoinFrames StrandEncodeWorker::encode(const Snapshot& published, const StrandEncodeConfig& config,
                                      Audience audience) {
  const int64_t begin_ns = now_ns();
  std::optional<Snapshot> reduced;
  if (config.strand_share < 1.0f)
    reduced = prefix_of(published, prefix_count(published.strand_count, config.strand_share));
  if (config.coarsening > 1) reduced = coarsen(reduced ? *reduced : published, config.coarsening);
  const Snapshot& snapshot = reduced ? *reduced : published;
  if (shared_ != nullptr) encoder_->set_state(shared_->take_state(snapshot.tick));
  JoinFrames frames;
  if (audience == Audience::Joiners) {
    frames = encoder_->encode_for_join(snapshot);
  } else {
    frames.frame = encoder_->encode(snapshot);
    const bool is_keyframe = frames.frame != nullptr && frames.frame->header.opcode == Opcode::StrandKeyframe;
    if (is_keyframe) frames.keyframe = frames.frame;
  }
  if (shared_ != nullptr && config.coarsening == 1)
    if (const auto update = encoder_->take_shared(shared_->wanted())) {
      if (update->is_told) told_ns_ = snapshot.sim_time_ns;
      shared_->put(std::move(*update));
    }
  count(frames, static_cast<double>(now_ns() - begin_ns) * kMsPerNs, audience);
  return frames;
}

void StrandEncodeWorker::count(const JoinFrames& frames, double encode_ms, Audience audience) {
  bool is_first_too_large = false;
  {
    const std::lock_guard lock(counters_mutex_);
    ++counters_.encodes;
    (audience == Audience::Joiners ? keyframe_timer_ : encode_timer_).add_ms(encode_ms);
    if (frames.frame == nullptr) is_first_too_large = counters_.too_large++ == 0;
    if (frames.frame != nullptr && frames.frame != frames.keyframe) {
      counters_.delta_bytes += frames.frame->message.size();
      counters_.exact += is_exact(*frames.frame) ? 1 : 0;
    }
    if (frames.keyframe != nullptr) {
      ++counters_.keyframes;
      counters_.keyframe_bytes += frames.keyframe->message.size();
    }
  }
  if (is_first_too_large)
    log_error("encode",
              "a state does not fit into one message of {} bytes: fewer strands or vertices are needed",
              kMaxMediaPayloadBytes);
}

void StrandEncodeWorker::give(const EncodedFramePtr& frame) {
  if (frame != nullptr) sink_(with_send_time(*frame, stream_id_, now_ns()));
}

}  // namespace strandcast
