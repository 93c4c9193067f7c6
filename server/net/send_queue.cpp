#include "server/net/send_queue.h"

#include <utility>

namespace strandcast {

bool SendQueue::push_control(ServerMessage message) {
  if (control_.size() >= kMaxQueuedControl) return false;
  control_.push_back(std::move(message));
  return true;
}

void SendQueue::set_asset(EncodedFramePtr asset) {
  pending_ = std::move(asset);
  is_pending_asset_ = pending_ != nullptr;
}

void SendQueue::start_strands() {
  chain_ = Chain::Waiting;
}

bool SendQueue::stop_strands() {
  chain_ = Chain::None;
  pending_ = nullptr;
  return !std::exchange(is_pending_asset_, false);
}

SendQueue::Offer SendQueue::offer_strands(const EncodedFramePtr& frame) {
  const FrameHeader& header = frame->header;
  if (chain_ == Chain::None) return Offer::Ignored;
  if (header.opcode == Opcode::StrandKeyframe) {
    // A viewer that follows the chain already has the state a late joiner's keyframe repeats.
    if (chain_ == Chain::Following && header.sequence == chain_sequence_) return Offer::Ignored;
    if (chain_ == Chain::Waiting && !needs_keyframe()) return Offer::Ignored;
    if (pending_ != nullptr) drop_pending();
  } else {
    if (chain_ != Chain::Following) return Offer::Ignored;
    if (pending_ != nullptr || header.base_sequence != chain_sequence_) {
      ++dropped_frames_;
      lose_chain();
      return Offer::LostChain;
    }
  }
  pending_ = frame;
  chain_ = Chain::Following;
  chain_sequence_ = header.sequence;
  return Offer::Queued;
}

void SendQueue::offer_picture(const EncodedFramePtr& frame) {
  if (chain_ == Chain::Waiting || (pending_ != nullptr && is_pending_asset_)) {
    ++dropped_frames_;
    return;
  }
  if (pending_ != nullptr) drop_pending();
  pending_ = frame;
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
  if (pending_ == nullptr || media == Media::Held) return std::nullopt;
  is_writing_media_ = true;
  is_pending_asset_ = false;
  return Item(std::exchange(pending_, nullptr));
}

void SendQueue::written() {
  is_writing_media_ = false;
}

void SendQueue::clear() {
  control_.clear();
  pending_ = nullptr;
  is_pending_asset_ = false;
  chain_ = Chain::None;
}

void SendQueue::drop_pending() {
  pending_ = nullptr;
  ++dropped_frames_;
}

}  // namespace strandcast
