#include "client/replay/strand_replay.h"

#include <algorithm>
#include <utility>

namespace strandcast {

StrandPicture picture_of(const Snapshot& snapshot, StrandFill& fill) {
  return StrandPicture{snapshot.world_from_head, fill.positions(snapshot)};
}

StrandPicture blend(StrandPicture from, const StrandPicture& to, double blend) {
  if (blend <= 0.0) return from;
  // Without a rest shape a change to fewer strands leaves nothing to blend.
  if (blend >= 1.0 || from.position_m.size() != to.position_m.size()) return to;
  from.world_from_head = interpolate(from.world_from_head, to.world_from_head, blend);
  const auto weight = static_cast<float>(blend);
  for (size_t i = 0; i < to.position_m.size(); ++i)
    from.position_m[i] += weight * (to.position_m[i] - from.position_m[i]);
  return from;
}

Result<std::unique_ptr<StrandReplay>> StrandReplay::make(const Welcome& welcome,
                                                         KeyframeRequester request_keyframe) {
  const StrandStreamLimits limits{welcome.strand_count, welcome.vertex_count};
  ASSIGN_OR_RETURN(auto decoder, make_strand_decoder(welcome.codec, limits));
  return std::unique_ptr<StrandReplay>(
      new StrandReplay(std::move(decoder), welcome, std::move(request_keyframe)));
}

StrandReplay::StrandReplay(std::unique_ptr<StrandDecoder> decoder, const Welcome& welcome,
                           KeyframeRequester request_keyframe)
    : decoder_(std::move(decoder)),
      strand_count_(welcome.strand_count),
      vertex_count_(welcome.vertex_count),
      request_keyframe_(std::move(request_keyframe)) {}

void StrandReplay::set_rest_shape(std::span<const glm::vec3> rest_in_head_m) {
  decoder_->set_rest_shape(rest_in_head_m);
  const bool fits = rest_in_head_m.size() == size_t{strand_count_} * vertex_count_;
  fill_ = fits ? StrandFill(rest_in_head_m, vertex_count_) : StrandFill();
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
  if (is_other_stream) last_sequence_ = 0;
  note_sequence(*header);

  const int64_t begin_ns = now_ns();
  auto decoded = decoder_->decode(message);
  if (!decoded) {
    reject(decoded.error(), receive_time_ns);
    return nullptr;
  }
  std::shared_ptr<const Snapshot> snapshot = std::move(decoded).value();
  const int64_t decoded_ns = now_ns();
  decode_timer_.add_ms(static_cast<double>(decoded_ns - begin_ns) * 1e-6);
  ++stats_.decoded_frames;
  stream_id_ = header->stream_id;
  if (header->opcode == Opcode::StrandKeyframe) ++stats_.keyframes;
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
  keep(snapshot, receive_time_ns, is_other_stream);
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

void StrandReplay::keep(std::shared_ptr<const Snapshot> snapshot, int64_t receive_time_ns,
                        bool is_other_stream) {
  // A keyframe on request repeats the state that is already here.
  if (!snapshots_.empty() && snapshot->sim_time_ns == snapshots_.back()->sim_time_ns) {
    snapshots_.back() = std::move(snapshot);
    return;
  }
  // The first keyframe of another stream may be of a state that the old stream has passed: what is shown
  // stays.
  if (is_other_stream && !snapshots_.empty()) {
    const int64_t behind_ns = snapshots_.back()->sim_time_ns - snapshot->sim_time_ns;
    if (behind_ns > 0 && behind_ns < kStreamOverlapNs) return;
  }
  playout_clock_.add(receive_time_ns, snapshot->sim_time_ns);
  // A reset server starts at zero again: blending across it would sweep the hair through the head.
  const bool goes_back = !snapshots_.empty() && snapshot->sim_time_ns < snapshots_.back()->sim_time_ns;
  if (goes_back) {
    snapshots_.clear();
    cursor_ = {};
  }
  snapshots_.push_back(std::move(snapshot));
  const size_t kept = playout_ == Playout::Smooth ? kKeptSnapshots : 1;
  while (snapshots_.size() > kept) snapshots_.pop_front();
}

std::shared_ptr<const Snapshot> StrandReplay::newest() const {
  return snapshots_.empty() ? nullptr : snapshots_.back();
}

std::optional<StrandPicture> StrandReplay::picture_at(int64_t client_time_ns) {
  if (snapshots_.empty()) return std::nullopt;
  if (playout_ == Playout::LowLatency || snapshots_.size() < 2 || !playout_clock_.has_value())
    return picture_of(*snapshots_.back(), fill_);

  // While nothing new comes, time rests on the newest state; what then arrives late is caught up from there.
  const int64_t wanted_ns =
      std::min(playout_clock_.sim_time_at(client_time_ns), snapshots_.back()->sim_time_ns);
  const int64_t sim_time_ns = cursor_.advance(client_time_ns, wanted_ns);
  const auto later = std::find_if(snapshots_.begin(), snapshots_.end(), [sim_time_ns](const auto& snapshot) {
    return snapshot->sim_time_ns > sim_time_ns;
  });
  if (later == snapshots_.end()) return picture_of(*snapshots_.back(), fill_);
  if (later == snapshots_.begin()) return picture_of(**later, fill_);
  const Snapshot& from = **std::prev(later);
  const Snapshot& to = **later;
  const auto span_ns = static_cast<double>(to.sim_time_ns - from.sim_time_ns);
  // Both have all strands, also when the stream has changed to one with fewer in between.
  return blend(picture_of(from, fill_), picture_of(to, fill_),
               static_cast<double>(sim_time_ns - from.sim_time_ns) / span_ns);
}

double StrandReplay::state_age_ms(int64_t client_time_ns, const ClockOffset& clock) const {
  if (snapshots_.empty() || newest_send_time_ns_ == 0 || !clock.has_value()) return 0.0;
  return static_cast<double>(clock.to_server_ns(client_time_ns) - newest_send_time_ns_) * 1e-6;
}

}  // namespace strandcast
