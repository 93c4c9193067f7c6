#include "common/client/mailbox.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace strandcast {
namespace {

bool is_strand_frame(Opcode opcode) {
  return opcode == Opcode::StrandKeyframe || opcode == Opcode::StrandDelta;
}

bool stands_alone(const FrameHeader& header) {
  return is_chained_picture(header.opcode) ? header.base_sequence == 0
                                           : header.opcode == Opcode::StrandKeyframe;
}

}  // namespace

template <class Predicate>
size_t Mailbox::erase_media(Predicate predicate) {
  return std::erase_if(events_, [&](const ClientEvent& event) {
    const auto* media = std::get_if<MediaEvent>(&event);
    return media != nullptr && predicate(media->header.opcode);
  });
}

void Mailbox::append(ClientEvent event) {
  events_.push_back(std::move(event));
  arrived_.notify_one();
}

Mailbox::Outcome Mailbox::push(MediaEvent event) {
  const std::lock_guard lock(mutex_);
  if (is_closed_) return Outcome::Kept;
  const Opcode opcode = event.header.opcode;
  if (is_strand_frame(opcode)) return push_chained(std::move(event), strands_);
  if (is_chained_picture(opcode)) return push_chained(std::move(event), pictures_);
  erase_media([opcode](Opcode other) { return other == opcode; });
  append(std::move(event));
  return Outcome::Kept;
}

Mailbox::Outcome Mailbox::push_chained(MediaEvent event, Lane& lane) {
  const bool is_alone = stands_alone(event.header);
  if (is_alone) lane.is_waiting_for_keyframe = false;
  if (lane.is_waiting_for_keyframe) {
    ++dropped_frames_;
    return Outcome::KeyframeNeeded;
  }
  const bool overflows = lane.frame_count + 1 > limits_.chained_frames ||
                         lane.bytes + event.message.size() > limits_.chained_bytes;
  if (overflows) {
    const bool is_strands = is_strand_frame(event.header.opcode);
    dropped_frames_ += erase_media(is_strands ? is_strand_frame : is_chained_picture);
    lane = {};
    // A keyframe stands alone, so it may start the queue afresh; a delta cannot be used any more.
    if (!is_alone) {
      ++dropped_frames_;
      lane.is_waiting_for_keyframe = true;
      return Outcome::KeyframeNeeded;
    }
  }
  ++lane.frame_count;
  lane.bytes += event.message.size();
  append(std::move(event));
  return Outcome::Kept;
}

template <class Event>
void Mailbox::keep_newest(const Event& event) {
  const std::lock_guard lock(mutex_);
  if (is_closed_) return;
  std::erase_if(events_, [](const ClientEvent& old) { return std::holds_alternative<Event>(old); });
  append(event);
}

void Mailbox::push(const ServerStatus& status) {
  keep_newest(status);
}

void Mailbox::push(const StreamQuality& quality) {
  keep_newest(quality);
}

void Mailbox::push(const SessionList& list) {
  keep_newest(list);
}

void Mailbox::push(const ModeChange& change) {
  keep_newest(change);
}

void Mailbox::push(const FrameQuality& quality) {
  keep_newest(quality);
}

void Mailbox::push(const LookChange& look) {
  keep_newest(look);
}

void Mailbox::push(const SceneText& scene) {
  keep_newest(scene);
}

void Mailbox::push(const CameraChange& camera) {
  keep_newest(camera);
}

void Mailbox::push(const StreamList& streams) {
  keep_newest(streams);
}

template <class Event>
void Mailbox::keep_some(Event event, size_t limit) {
  const std::lock_guard lock(mutex_);
  if (is_closed_) return;
  const auto is_alike = [](const ClientEvent& other) { return std::holds_alternative<Event>(other); };
  if (static_cast<size_t>(std::count_if(events_.begin(), events_.end(), is_alike)) >= limit)
    events_.erase(std::find_if(events_.begin(), events_.end(), is_alike));
  append(std::move(event));
}

void Mailbox::push(Notice notice) {
  keep_some(std::move(notice), limits_.notices);
}

void Mailbox::push(ParameterList list) {
  keep_some(std::move(list), limits_.parameter_lists);
}

void Mailbox::push(StateTimes times) {
  keep_some(std::move(times), limits_.state_times);
}

void Mailbox::close(Error error) {
  const std::lock_guard lock(mutex_);
  if (is_closed_) return;
  is_closed_ = true;
  append(ClosedEvent{std::move(error)});
}

std::vector<ClientEvent> Mailbox::take() {
  return wait(std::chrono::milliseconds(0));
}

std::vector<ClientEvent> Mailbox::wait(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  if (timeout.count() > 0) arrived_.wait_for(lock, timeout, [this] { return !events_.empty(); });
  std::vector<ClientEvent> taken(std::make_move_iterator(events_.begin()),
                                 std::make_move_iterator(events_.end()));
  events_.clear();
  for (Lane* lane : {&strands_, &pictures_}) {
    lane->frame_count = 0;
    lane->bytes = 0;
  }
  return taken;
}

std::optional<ClientEvent> Mailbox::next(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  if (timeout.count() > 0) arrived_.wait_for(lock, timeout, [this] { return !events_.empty(); });
  if (events_.empty()) return std::nullopt;
  std::optional<ClientEvent> event(std::move(events_.front()));
  events_.pop_front();
  leave_lane(*event);
  return event;
}

void Mailbox::leave_lane(const ClientEvent& event) {
  const auto* media = std::get_if<MediaEvent>(&event);
  if (media == nullptr) return;
  const bool is_strands = is_strand_frame(media->header.opcode);
  if (!is_strands && !is_chained_picture(media->header.opcode)) return;
  Lane& lane = is_strands ? strands_ : pictures_;
  --lane.frame_count;
  lane.bytes -= media->message.size();
}

uint64_t Mailbox::dropped_frames() const {
  const std::lock_guard lock(mutex_);
  return dropped_frames_;
}

}  // namespace strandcast
