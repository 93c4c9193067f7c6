#include "server/record/recorder.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "common/base/hash.h"
#include "common/base/profile.h"
#include "common/base/thread_name.h"
#include "common/base/units.h"
#include "common/log/log.h"
#include "common/strands/shared_strands.h"
#include "common/strands/strand_codec.h"
#include "server/record/recorded_step.h"

namespace strandcast {
namespace {

constexpr double kBytesPerMb = 1e6;
/// While it waits for one.
constexpr int64_t kNever = -1;
/// The simulation goes on from what a keyframe tells, and frames are exact from then on. The first one comes
/// too early for that.
constexpr int64_t kSecondKeyframeNs = 200'000'000;
/// Strands of a state so much older than the first recorded one are from before the recording.
constexpr int64_t kOldFrameNs = 250'000'000;

int64_t unix_time_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace

Result<std::unique_ptr<Recorder>> Recorder::make(const RecordConfig& config) {
  ASSIGN_OR_RETURN(auto file, RecordFile::make(config.path, config.if_present));
  return std::unique_ptr<Recorder>(new Recorder(config, std::move(file)));
}

Recorder::Recorder(RecordConfig config, std::unique_ptr<RecordFile> file)
    : config_(std::move(config)), file_(std::move(file)) {
  start_.server_time_ns = now_ns();
  start_.unix_time_ns = unix_time_ns();
}

Recorder::~Recorder() {
  stop();
}

Status Recorder::attach(StreamHub& hub) {
  hub_ = &hub;
  start_.codec = hub.strand_codecs().front();
  stream_id_ = stream_id_of({0, 0});
  reader_ = hub.add(*this, {});
  Demand demand;
  demand.strand_stream = stream_id_;
  demand.has_states = true;
  demand.has_inputs = true;
  RETURN_IF_ERROR(hub.set_demand(reader_, demand));
  hub.request_keyframe(stream_id_);
  return {};
}

void Recorder::begin(RecordingStart start, EncodedFramePtr asset) {
  start.server_time_ns = start_.server_time_ns;
  start.unix_time_ns = start_.unix_time_ns;
  start.codec = start_.codec;
  start.asset_hash = hash_bytes(std::span<const std::byte>(asset->message).subspan(kFrameHeaderBytes));
  start_ = std::move(start);
  const auto codec = strand_codec_info(start_.codec);
  is_predicted_ = codec && codec->predicts;
  asset_ = std::move(asset);
  file_->keep();
  log_info("record", "recording to {}: inputs, steps, states, and strands by {}", config_.path.string(),
           start_.codec);
  thread_ = std::thread([this] {
    name_thread("record");
    run();
  });
}

void Recorder::add(const ServerStatus& status) {
  push({now_ns(), RecordedMessage(status)});
}

void Recorder::on_strands(const EncodedFramePtr& frame) {
  push({now_ns(), frame});
}
void Recorder::on_state(const StatePtr& state) {
  push_of_simulation({now_ns(), state});
}
void Recorder::on_motion(uint64_t source, const MotionSamples& samples, int64_t arrival_ns) {
  push({now_ns(), RecordedMessage(RecordedMotion{source, arrival_ns, samples})});
}
void Recorder::on_wind(uint64_t source, const WindSamples& samples, int64_t arrival_ns) {
  push({now_ns(), RecordedMessage(RecordedWind{source, arrival_ns, samples})});
}
void Recorder::on_camera(uint64_t viewer, const CameraDesc& camera) {
  push({now_ns(), RecordedMessage(RecordedCamera{viewer, camera})});
}
void Recorder::on_look_change(const LookChange& look) {
  push({now_ns(), RecordedMessage(look)});
}

void Recorder::on_step(const TakenStep& step) {
  push_of_simulation({now_ns(), RecordedMessage(to_recorded(step))});
}
void Recorder::on_change(const PostedChange& change) {
  open_change_ = RecordedChange{change.tick, change.what, change.who, {}};
}
/// The change first, then what came of it.
void Recorder::on_answer(const Notice& answer) {
  if (!open_change_) return;
  RecordedChange change = *std::exchange(open_change_, std::nullopt);
  change.answer = answer;
  push({now_ns(), RecordedMessage(std::move(change))});
  for (Item& item : std::exchange(held_, {})) push(std::move(item));
}
void Recorder::on_lattice(const LatticeChange& change) {
  push_of_simulation({now_ns(), RecordedMessage(RecordedStream{change.tick, change.stream.codec,
                                                               static_cast<double>(change.stream.bound_m)})});
}

void Recorder::on_hand_over(const HandOver& hand_over) {
  push_of_simulation({now_ns(), RecordedMessage(RecordedHandOver{hand_over.tick, hand_over.update.tick,
                                                                 hand_over.update.sequence})});
}

void Recorder::push_of_simulation(Item item) {
  if (open_change_)
    held_.push_back(std::move(item));
  else
    push(std::move(item));
}

/// Waits for nothing. Of what finds no place strands and states are counted by their bytes.
void Recorder::push(Item item) {
  uint64_t bytes = 0;
  const bool is_frame = std::holds_alternative<EncodedFramePtr>(item.what);
  if (const auto* state = std::get_if<StatePtr>(&item.what))
    bytes = (*state)->lattice.size() * sizeof(int32_t);
  if (is_frame) bytes = std::get<EncodedFramePtr>(item.what)->message.size();
  {
    const std::lock_guard lock(mutex_);
    const int64_t strands_ns =
        is_frame ? std::get<EncodedFramePtr>(item.what)->header.sim_time_ns : INT64_MAX;
    if (is_ended_ || (is_refusing_ && strands_ns > state_ns_)) return;
    if (is_frame) strands_ns_ = std::max(strands_ns_, strands_ns);
    if (const auto* state = std::get_if<StatePtr>(&item.what)) state_ns_ = (*state)->sim_time_ns;
    const bool is_full = bytes > 0 ? waiting_bytes_ + bytes > kMaxRecorderBytes && !waiting_.empty()
                                   : waiting_.size() >= kMaxRecorderItems;
    if (is_full) {
      (is_frame ? refused_.frames : refused_.messages) += 1;
      refused_.bytes += bytes;
      return;
    }
    waiting_bytes_ += bytes;
    waiting_.push_back(std::move(item));
  }
  changed_.notify_one();
  if (is_frame) strands_came_.notify_all();
}

void Recorder::run() {
  writer_ = std::make_unique<RecordingWriter>(*file_, start_, *asset_);
  int64_t flushed_ns = now_ns();
  std::unique_lock lock(mutex_);
  while (!is_stopping_ || !waiting_.empty()) {
    const std::chrono::steady_clock::time_point wake{std::chrono::nanoseconds(flushed_ns + kRecordFlushNs)};
    changed_.wait_until(lock, wake, [this] { return is_stopping_ || !waiting_.empty(); });
    const std::deque<Item> items = std::exchange(waiting_, {});
    waiting_bytes_ = 0;
    writer_->note_lost(refused_);
    lock.unlock();
    for (const Item& item : items) write(item);
    if (now_ns() - flushed_ns >= kRecordFlushNs) {
      writer_->flush();
      flushed_ns = now_ns();
    }
    const bool has_failed = file_->failure().has_value();
    if (!has_failed) watch_losses();
    const RecordedLoss lost = writer_->lost();
    const int64_t lag_ns = items.empty() ? 0 : now_ns() - items.back().time_ns;
    lock.lock();
    counters_.lag_ms = static_cast<double>(lag_ns) * kMsPerNs;
    counters_.lost_frames = lost.frames;
    counters_.lost_messages = lost.messages;
    if (!has_failed) continue;
    is_ended_ = true;
    waiting_.clear();
    lock.unlock();
    end_early();
    return;
  }
}

/// Nothing can be written any more, and nothing is read for it.
void Recorder::end_early() {
  hub_->remove(reader_);
  const std::optional<Error> failure = file_->failure();
  log_error("record", "{}: the recording ends here, the server goes on: {}", config_.path.string(),
            failure ? failure->to_string() : std::string());
}

void Recorder::write(const Item& item) {
  if (const auto* state = std::get_if<StatePtr>(&item.what)) {
    const Snapshot& snapshot = **state;
    sim_time_ns_ = snapshot.sim_time_ns;
    if (!first_sim_ns_) {
      first_sim_ns_ = sim_time_ns_;
      take_early_frame();
    }
    vertex_count_ = snapshot.plane_size();
    tick_ = snapshot.tick;
    writer_->add(item.time_ns, sim_time_ns_,
                 RecordedState{snapshot.tick, snapshot.sim_time_ns, state_hash(snapshot), snapshot.timecode});
    const std::lock_guard lock(mutex_);
    ++counters_.states;
    counters_.last_tick = snapshot.tick;
    counters_.length_s = static_cast<double>(sim_time_ns_ - *first_sim_ns_) / kNsPerS;
  } else if (const auto* frame = std::get_if<EncodedFramePtr>(&item.what)) {
    write_frame(item.time_ns, *frame);
  } else {
    writer_->add(item.time_ns, sim_time_ns_, std::get<RecordedMessage>(item.what));
  }
}

/// A keyframe for those who join says what its delta says; here it takes the delta's place.
void Recorder::write_frame(int64_t time_ns, const EncodedFramePtr& frame) {
  const FrameHeader& header = frame->header;
  const bool is_keyframe = header.opcode == Opcode::StrandKeyframe;
  if (!first_sim_ns_ && is_keyframe) {
    early_frame_ = Item{time_ns, frame};
    return;
  }
  if (early_frame_) {  // that it builds on, and whose state is not known yet
    early_frame_.reset();
    hub_->request_keyframe(stream_id_);
  }
  const auto* held = held_frame_ ? &std::get<EncodedFramePtr>(held_frame_->what) : nullptr;
  if (is_keyframe && held != nullptr && (*held)->header.sequence == header.sequence) held_frame_.reset();
  write_held_frame();
  if (is_keyframe) {
    // One comes once more for whoever joins meanwhile.
    if (keyframes_ == 0 || header.sim_time_ns != keyframe_sim_ns_) ++keyframes_;
    is_chain_broken_ = false;
    keyframe_sim_ns_ = header.sim_time_ns;
    seek_cost_ = SeekCost(is_predicted_);
    decoded_tick_ = tick_;
    // Whoever begins here knows how it looks.
    writer_->add(time_ns, header.sim_time_ns, hub_->look());
  } else if (is_keyframe_due(*frame)) {
    keyframe_sim_ns_ = kNever;
    hub_->request_keyframe(stream_id_);
  }
  if (is_chain_broken_) return;
  held_frame_ = Item{time_ns, frame};
}

/// Before the first state a keyframe may be that of a server that nobody has read for long.
void Recorder::take_early_frame() {
  const std::optional<Item> early = std::exchange(early_frame_, std::nullopt);
  if (!early) return;
  const auto& frame = std::get<EncodedFramePtr>(early->what);
  if (*first_sim_ns_ - frame->header.sim_time_ns <= kOldFrameNs) {
    write_frame(early->time_ns, frame);
    return;
  }
  is_chain_broken_ = true;
  hub_->request_keyframe(stream_id_);
}

void SeekCost::add(const Delta& delta) {
  const auto vertices = static_cast<double>(delta.vertex_count);
  const double step_ns = is_predicted_ ? kRecordStepNs * delta.step_cost * vertices : 0.0;
  const double frame_ns = (is_predicted_ ? kRecordPredictedNs : kRecordDecodeNs) * vertices;
  usual_ns_ += step_ns + frame_ns;
  exact_ns_ += step_ns + (delta.is_exact ? 0.0 : frame_ns);
}

bool SeekCost::is_keyframe_due(int64_t passed_ns) const {
  if (passed_ns < kRecordKeyframeNs) return false;
  if (passed_ns >= kRecordMostKeyframeNs) return true;
  const double shortest_ns =
      usual_ns_ * static_cast<double>(kRecordKeyframeNs) / static_cast<double>(passed_ns);
  return exact_ns_ >= std::max(shortest_ns, kRecordSeekMs / kMsPerNs);
}

/// The delta is the newest.
bool Recorder::is_keyframe_due(const EncodedFrame& delta) {
  const auto steps = static_cast<double>(tick_ - std::min(decoded_tick_, tick_));
  decoded_tick_ = tick_;
  seek_cost_.add({is_exact(delta), vertex_count_, steps * step_cost_});
  if (keyframe_sim_ns_ == kNever) return false;
  const int64_t passed_ns = delta.header.sim_time_ns - keyframe_sim_ns_;
  const bool is_second_due =
      is_shared_ && keyframes_ == 1 && is_predicted_ && !is_exact(delta) && passed_ns >= kSecondKeyframeNs;
  if (config_.keyframe_s > 0.0 && is_exact(delta))
    return passed_ns >= std::llround(config_.keyframe_s * kNsPerS);
  return is_second_due || seek_cost_.is_keyframe_due(passed_ns);
}

void Recorder::write_held_frame() {
  if (!held_frame_) return;
  const auto& frame = std::get<EncodedFramePtr>(held_frame_->what);
  writer_->add(held_frame_->time_ns, *frame);
  {
    const std::lock_guard lock(mutex_);
    ++counters_.frames;
    counters_.frame_bytes += frame->message.size();
  }
  held_frame_.reset();
}

/// Asks for a keyframe when frames are missing: nothing after them can be decoded before it.
void Recorder::watch_losses() {
  const uint64_t lost = writer_->lost().frames;
  if (lost == known_lost_frames_) return;
  if (known_lost_frames_ == 0)
    log_warn("record", "{}: the disk is too slow: strands are missing from {:.1f} s on, and counted",
             config_.path.string(), static_cast<double>(sim_time_ns_) / kNsPerS);
  known_lost_frames_ = lost;
  is_chain_broken_ = true;
  held_frame_.reset();
  hub_->request_keyframe(stream_id_);
}

std::string Recorder::summary() const {
  const RecordCounters counts = counters();
  std::string text = fmt::format("{:.1f} MB, {} states up to step {}, {} frames",
                                 static_cast<double>(counts.written_bytes) / kBytesPerMb, counts.states,
                                 counts.last_tick, counts.frames);
  if (counts.lost_frames + counts.lost_messages == 0) return text + ", nothing lost";
  return text + fmt::format("; lost: {} frames and {} messages", counts.lost_frames, counts.lost_messages);
}

void Recorder::refuse() {
  const std::lock_guard lock(mutex_);
  is_refusing_ = true;
}

void Recorder::await_last_strands() {
  constexpr std::chrono::milliseconds kMostWait{500};
  std::unique_lock lock(mutex_);
  strands_came_.wait_for(lock, kMostWait, [this] { return is_ended_ || strands_ns_ >= state_ns_; });
}

void Recorder::stop() {
  {
    const std::lock_guard lock(mutex_);
    is_refusing_ = true;
    if (std::exchange(is_stopping_, true)) return;
  }
  changed_.notify_one();
  if (hub_ != nullptr) hub_->remove(reader_);
  if (!thread_.joinable()) return;
  thread_.join();
  if (is_ended_) return;
  if (early_frame_) {  // nothing was simulated
    first_sim_ns_ = std::get<EncodedFramePtr>(early_frame_->what)->header.sim_time_ns;
    take_early_frame();
  }
  write_held_frame();
  writer_->finish();
  file_->finish();
  if (const std::optional<Error> failure = file_->failure())
    log_error("record", "{}: the end of the recording is missing: {}", config_.path.string(),
              failure->to_string());
  log_info("record", "{}: {}", config_.path.string(), summary());
}

RecordCounters Recorder::counters() const {
  const std::lock_guard lock(mutex_);
  RecordCounters counters = counters_;
  counters.written_bytes = file_->written_bytes();
  counters.waiting_bytes = file_->waiting_bytes();
  counters.has_failed = file_->failure().has_value();
  return counters;
}

}  // namespace strandcast
