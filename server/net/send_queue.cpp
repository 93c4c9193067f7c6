#include "server/net/send_queue.h"

#include <utility>

#include "common/strands/shared_strands.h"

namespace strandcast {

bool SendQueue::push_control(ServerMessage message) {
  // Somebody drags a slider: of the looks that wait only the newest counts.
  if (std::holds_alternative<LookChange>(message))
    std::erase_if(control_, [](const auto& waiting) { return std::holds_alternative<LookChange>(waiting); });
  if (control_.size() >= kMaxQueuedControl) return false;
  control_.push_back(std::move(message));
  return true;
}

void SendQueue::set_asset(EncodedFramePtr asset) {
  pending_ = std::move(asset);
  is_pending_asset_ = pending_ != nullptr;
}

void SendQueue::renew_asset(EncodedFramePtr asset) {
  if (pending_ != nullptr && !is_pending_asset_) drop_pending();
  behind_.clear();
  if (chain_ == Chain::Following) chain_ = Chain::Waiting;
  set_asset(std::move(asset));
}

void SendQueue::start_strands() {
  chain_ = Chain::Waiting;
}

bool SendQueue::stop_strands() {
  chain_ = Chain::None;
  pending_ = nullptr;
  behind_.clear();
  return !std::exchange(is_pending_asset_, false);
}

SendQueue::Offer SendQueue::offer_strands(const EncodedFramePtr& frame) {
  const FrameHeader& header = frame->header;
  if (chain_ == Chain::None) return Offer::Ignored;
  if (header.opcode == Opcode::StrandKeyframe) {
    // A viewer that follows the chain already has the state a late joiner's keyframe repeats.
    if (chain_ == Chain::Following && header.sequence == chain_sequence_)
      return takes_all_ && put_behind(frame) ? Offer::Queued : Offer::Ignored;
    if (chain_ == Chain::Waiting && !needs_keyframe()) return Offer::Ignored;
    if (pending_ != nullptr) drop_pending();
  } else {
    if (chain_ != Chain::Following) return Offer::Ignored;
    if (header.base_sequence != chain_sequence_ || !put_behind(frame)) {
      ++dropped_frames_;
      lose_chain();
      return Offer::LostChain;
    }
    chain_sequence_ = header.sequence;
    return Offer::Queued;
  }
  pending_ = frame;
  chain_ = Chain::Following;
  chain_sequence_ = header.sequence;
  return Offer::Queued;
}

SendQueue::Offer SendQueue::offer_chain(std::span<const EncodedFramePtr> chain) {
  if (chain.empty() || !needs_keyframe()) return Offer::Ignored;
  pending_ = chain.front();
  behind_.assign(chain.begin() + 1, chain.end());
  catch_up_room_ = kCatchUpFrames * behind_.size();
  chain_ = Chain::Following;
  chain_sequence_ = chain.back()->header.sequence;
  return Offer::Queued;
}

/// Behind what waits already; false when there is no room.
bool SendQueue::put_behind(const EncodedFramePtr& frame) {
  if (pending_ == nullptr) {
    pending_ = frame;
    return true;
  }
  const size_t bytes = frame->message.size();
  if (takes_all_) {
    if (behind_.size() >= kMaxRelayFrames) return false;
  } else if (bytes <= kExactFrameBytes && is_exact(*frame) && behind_.size() < kWaitingExactFrames) {
    // Takes nothing of the room for others.
  } else if (catch_up_room_ > 0) {
    --catch_up_room_;
  } else if (bytes < keyframe_room_) {
    keyframe_room_ -= bytes;
  } else {
    return false;
  }
  behind_.push_back(frame);
  return true;
}

void SendQueue::stop_pictures() {
  if (pending_picture_ != nullptr) ++dropped_frames_;
  pending_picture_ = nullptr;
  pictures_ = Pictures::None;
}

void SendQueue::start_pictures() {
  if (pending_picture_ != nullptr) ++dropped_frames_;
  pending_picture_ = nullptr;
  shown_picture_ = 0;
  pictures_ = Pictures::Waiting;
}

SendQueue::Offer SendQueue::offer_picture(const PicturePtr& picture) {
  if (pictures_ == Pictures::None) return Offer::Ignored;
  const bool is_known = picture->sequence() == shown_picture_ ||
                        (pending_picture_ != nullptr && pending_picture_->sequence() == picture->sequence());
  if (is_known) return Offer::Ignored;
  if (!picture->can_follow(shown_picture_)) {
    if (pictures_ == Pictures::Waiting) return Offer::Ignored;
    ++dropped_frames_;
    ++chain_losses_;
    start_pictures();
    return Offer::LostChain;
  }
  if (pending_picture_ != nullptr) ++dropped_frames_;
  pending_picture_ = picture;
  pictures_ = Pictures::Following;
  return Offer::Queued;
}

bool SendQueue::needs_picture() const {
  return pictures_ == Pictures::Waiting && pending_ == nullptr && !is_writing_media_;
}

void SendQueue::lose_chain() {
  if (chain_ == Chain::Following) {
    chain_ = Chain::Waiting;
    ++chain_losses_;
    if (pending_ != nullptr && !is_pending_asset_) drop_pending();
  }
}

bool SendQueue::needs_keyframe() const {
  return chain_ == Chain::Waiting && pending_ == nullptr && !is_writing_media_;
}

void SendQueue::restart_strands() {
  if (chain_ != Chain::Following) return;
  chain_ = Chain::Waiting;
  if (pending_ != nullptr && !is_pending_asset_) drop_pending();
}

std::optional<SendQueue::Item> SendQueue::take_next(Media media) {
  if (!control_.empty()) {
    Item item = std::move(control_.front());
    control_.pop_front();
    return item;
  }
  if (media == Media::Held) return std::nullopt;
  if (pending_ == nullptr && pending_picture_ != nullptr) {
    const PicturePtr picture = std::exchange(pending_picture_, nullptr);
    EncodedFramePtr frame = picture->after(std::exchange(shown_picture_, picture->sequence()));
    is_writing_media_ = frame != nullptr;
    return frame != nullptr ? std::optional<Item>(std::move(frame)) : std::nullopt;
  }
  if (pending_ == nullptr) return std::nullopt;
  is_writing_media_ = true;
  is_pending_asset_ = false;
  EncodedFramePtr frame = std::exchange(pending_, nullptr);
  if (behind_.empty()) {
    const bool is_keyframe = frame->header.opcode == Opcode::StrandKeyframe;
    catch_up_room_ = 0;
    keyframe_room_ = is_keyframe ? frame->message.size() : 0;
  } else {
    pending_ = std::move(behind_.front());
    behind_.pop_front();
  }
  return Item(std::move(frame));
}

void SendQueue::written() {
  is_writing_media_ = false;
}

void SendQueue::clear() {
  control_.clear();
  pending_ = nullptr;
  behind_.clear();
  is_pending_asset_ = false;
  chain_ = Chain::None;
  pending_picture_ = nullptr;
  pictures_ = Pictures::None;
}

void SendQueue::drop_pending() {
  pending_ = nullptr;
  dropped_frames_ += 1 + behind_.size();
  behind_.clear();
  catch_up_room_ = keyframe_room_ = 0;
}

}  // namespace strandcast
