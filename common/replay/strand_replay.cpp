#include "common/replay/strand_replay.h"

#include <algorithm>
#include <utility>

#include "common/strands/shared_strands.h"

namespace strandcast {

Result<std::unique_ptr<StrandReplay>> StrandReplay::make(const std::string& codec,
                                                         const StrandStreamLimits& limits,
                                                         KeyframeRequester request_keyframe) {
  ASSIGN_OR_RETURN(auto decoder, make_strand_decoder(codec, limits));
  return std::unique_ptr<StrandReplay>(
      new StrandReplay({codec, std::move(decoder)}, limits, std::move(request_keyframe)));
}

StrandReplay::StrandReplay(Decoding decoding, const StrandStreamLimits& limits,
                           KeyframeRequester request_keyframe)
    : now_(std::move(decoding)),
      strand_count_(limits.strand_count),
      vertex_count_(limits.vertex_count),
      request_keyframe_(std::move(request_keyframe)) {}

void StrandReplay::set_rest_shape(std::span<const glm::vec3> rest_in_head_m) {
  now_.decoder->set_rest_shape(rest_in_head_m);
  if (next_) next_->decoder->set_rest_shape(rest_in_head_m);
  const bool fits = rest_in_head_m.size() == size_t{strand_count_} * vertex_count_;
  player_.set_fill(fits ? StrandFill(rest_in_head_m, vertex_count_) : StrandFill());
}

Status StrandReplay::follow_codec(const std::string& codec, std::span<const glm::vec3> rest_in_head_m) {
  if (codec == (next_ ? next_->codec : now_.codec)) return {};
  if (codec == now_.codec) {
    next_.reset();
    return {};
  }
  ASSIGN_OR_RETURN(auto decoder, make_strand_decoder(codec, {strand_count_, vertex_count_}));
  if (!rest_in_head_m.empty()) decoder->set_rest_shape(rest_in_head_m);
  next_ = Decoding{codec, std::move(decoder)};
  if (newest() == nullptr) begin_next();
  return {};
}

void StrandReplay::begin_next() {
  now_ = std::move(*next_);
  next_.reset();
  decode_timer_ = {};  // what the other codec took says nothing
}

std::shared_ptr<const Snapshot> StrandReplay::receive(std::span<const std::byte> message,
                                                      int64_t receive_time_ns, const ClockOffset& clock) {
  ++stats_.received_frames;
  stats_.received_bytes += message.size();
  const auto header = unpack_frame_header(message);
  if (!header) {
    reject(header.error(), receive_time_ns);
    return nullptr;
  }
  if (const Status status = check_stream(*header); !status) {
    reject(status.error(), receive_time_ns);
    return nullptr;
  }
  const bool is_other_stream = last_sequence_ != 0 && header->stream_id != stream_id_;
  if (is_other_stream) last_sequence_ = decoded_sequence_ = 0;
  note_sequence(*header);

  // Streams of two codecs have no number in common, so what is still on its way by the old one decodes.
  const bool is_next = next_ && header->opcode == Opcode::StrandKeyframe && header->stream_id != stream_id_;
  const int64_t begin_ns = now_ns();
  auto decoded = (is_next ? *next_ : now_).decoder->decode(message);
  if (!decoded) {
    const bool has_base = header->opcode == Opcode::StrandKeyframe ||
                          (decoded_sequence_ != 0 && header->sequence == decoded_sequence_ + 1);
    if (has_base) ++stats_.wrong_states;
    reject(decoded.error(), receive_time_ns);
    return nullptr;
  }
  if (is_next) begin_next();
  std::shared_ptr<const Snapshot> snapshot = std::move(decoded).value();
  const int64_t decoded_ns = now_ns();
  decode_timer_.add_ms(static_cast<double>(decoded_ns - begin_ns) * 1e-6);
  ++stats_.decoded_frames;
  stream_id_ = header->stream_id;
  decoded_sequence_ = header->sequence;
  if (header->opcode == Opcode::StrandKeyframe) ++stats_.keyframes;
  if (is_exact(message)) ++stats_.exact_frames;
  newest_send_time_ns_ = header->send_time_ns;

  // Only the first state with a new motion sample counts: the same sample in later states is not late, it is
  // held.
  const int64_t motion_time_ns = snapshot->motion_time_ns;
  if (motion_time_ns != 0 && motion_time_ns != last_motion_time_ns_ && clock.has_value()) {
    // Waiting in the mailbox is part of the way, so the clock is read now and not at the frame's arrival.
    const int64_t latency_ns = clock.to_server_ns(decoded_ns) - motion_time_ns;
    if (last_motion_time_ns_ != 0) motion_latency_timer_.add_ms(static_cast<double>(latency_ns) * 1e-6);
    last_motion_time_ns_ = motion_time_ns;
  }
  timeline_.add(snapshot, receive_time_ns,
                is_other_stream ? Continuity::OtherStream : Continuity::SameStream);
  return snapshot;
}

/// Every stream counts its frames by itself: the same number in another one is another state.
Status StrandReplay::check_stream(const FrameHeader& header) const {
  if (header.stream_id == stream_id_ || header.opcode == Opcode::StrandKeyframe) return {};
  return make_error(ErrorCode::Unavailable, "delta {} is of stream {}, the newest keyframe of stream {}",
                    header.sequence, header.stream_id, stream_id_);
}

void StrandReplay::note_sequence(const FrameHeader& header) {
  // A keyframe for a late joiner repeats the number of the chain's present state, so equal is no gap.
  if (last_sequence_ != 0 && header.sequence > last_sequence_ + 1) {
    ++stats_.gaps;
    stats_.missed_frames += header.sequence - last_sequence_ - 1;
  }
  last_sequence_ = header.sequence;
}

void StrandReplay::reject(const Error& error, int64_t receive_time_ns) {
  ++stats_.rejected_frames;
  stats_.last_error = error.to_string();
  if (last_keyframe_request_ns_ && receive_time_ns - *last_keyframe_request_ns_ < kReplayKeyframeRequestNs)
    return;
  last_keyframe_request_ns_ = receive_time_ns;
  ++stats_.keyframe_requests;
  if (request_keyframe_) request_keyframe_();
}

double StrandReplay::state_age_ms(int64_t client_time_ns, const ClockOffset& clock) const {
  if (timeline_.newest() == nullptr || newest_send_time_ns_ == 0 || !clock.has_value()) return 0.0;
  return static_cast<double>(clock.to_server_ns(client_time_ns) - newest_send_time_ns_) * 1e-6;
}

namespace {

uint64_t bytes_of(const Snapshot& snapshot) {
  return snapshot.lattice.size() * sizeof(int32_t);
}
uint64_t bytes_of(const std::deque<std::shared_ptr<const Snapshot>>& snapshots) {
  uint64_t bytes = 0;
  for (const auto& snapshot : snapshots) bytes += bytes_of(*snapshot);
  return bytes;
}

}  // namespace

void SnapshotTimeline::add(std::shared_ptr<const Snapshot> snapshot, int64_t receive_time_ns,
                           Continuity continuity) {
  // A keyframe on request repeats the state that is already here.
  if (!snapshots_.empty() && snapshot->sim_time_ns == snapshots_.back()->sim_time_ns) {
    snapshots_.back() = std::move(snapshot);
    return;
  }
  // The first keyframe of another stream may be of a state that the old stream has passed: what is shown
  // stays.
  if (continuity == Continuity::OtherStream && !snapshots_.empty()) {
    const int64_t behind_ns = snapshots_.back()->sim_time_ns - snapshot->sim_time_ns;
    if (behind_ns > 0 && behind_ns < kStreamOverlapNs) return;
  }
  // Waiting for a fourth state is no use where there is no room for four.
  clock_.limit_frames_behind(KnotTimes{}.size() * bytes_of(*snapshot) <= limit_bytes_ ? 2 : 1);
  clock_.add(receive_time_ns, snapshot->sim_time_ns);
  // A reset server starts at zero again: blending across it would sweep the hair through the head.
  const bool goes_back = !snapshots_.empty() && snapshot->sim_time_ns < snapshots_.back()->sim_time_ns;
  if (goes_back) {
    snapshots_.clear();
    ++restarts_;
  }
  snapshots_.push_back(std::move(snapshot));
  const size_t kept = playout_ == Playout::Smooth ? kKeptSnapshots : 1;
  while (snapshots_.size() > kept || (snapshots_.size() > 2 && bytes_of(snapshots_) > limit_bytes_))
    snapshots_.pop_front();
}

std::shared_ptr<const Snapshot> SnapshotTimeline::newest() const {
  return snapshots_.empty() ? nullptr : snapshots_.back();
}

std::optional<PosedStrands> TimelinePlayer::strands_at(const SnapshotTimeline& timeline,
                                                       int64_t client_time_ns) {
  const auto& snapshots = timeline.snapshots();
  interpolation_ = Interpolation::None;
  if (std::exchange(restarts_, timeline.restarts()) != timeline.restarts()) cursor_ = {};
  if (snapshots.empty()) return std::nullopt;
  sim_time_ns_ = snapshots.back()->sim_time_ns;
  if (timeline.playout() == Playout::LowLatency || snapshots.size() < 2 || !timeline.clock().has_value()) {
    blend_.leave();
    return blend_.at(*snapshots.back());
  }

  // While nothing new comes, time rests on the newest state; what then arrives late is caught up from there.
  const int64_t wanted_ns =
      std::min(timeline.clock().sim_time_at(client_time_ns), snapshots.back()->sim_time_ns);
  const int64_t sim_time_ns = cursor_.advance(client_time_ns, wanted_ns);
  const auto later = std::find_if(snapshots.begin(), snapshots.end(), [sim_time_ns](const auto& snapshot) {
    return snapshot->sim_time_ns > sim_time_ns;
  });
  if (later == snapshots.end()) return blend_.at(*snapshots.back());
  sim_time_ns_ = later == snapshots.begin() ? (*later)->sim_time_ns : sim_time_ns;
  if (later == snapshots.begin()) return blend_.at(**later);
  PosedStrands strands =
      blend_.between(snapshots, static_cast<size_t>(later - snapshots.begin()), sim_time_ns);
  interpolation_ = blend_.interpolation();
  return strands;
}

}  // namespace strandcast
