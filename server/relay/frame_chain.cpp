#include "server/relay/frame_chain.h"

namespace strandcast {

void FrameChain::add(const EncodedFramePtr& frame, int64_t time_ns) {
  newest_ns_ = time_ns;
  if (frame->header.opcode == Opcode::StrandKeyframe) {
    frames_.assign(1, frame);
    delta_bytes_ = 0;
    keyframe_ns_ = time_ns;
    return;
  }
  if (frames_.empty()) return;
  delta_bytes_ += frame->message.size();
  const bool follows = frame->header.base_sequence == frames_.back()->header.sequence;
  if (!follows || frames_.size() > kMaxChainFrames || delta_bytes_ > kMaxChainBytes) return clear();
  frames_.push_back(frame);
}

bool FrameChain::serves_joiners() const {
  if (frames_.empty()) return false;
  const int64_t age_ns = newest_ns_ - keyframe_ns_;
  return age_ns < kChainNs || (age_ns < kLongestChainNs && delta_bytes_ < frames_.front()->message.size());
}

void FrameChain::clear() {
  frames_.clear();
  delta_bytes_ = 0;
}

}  // namespace strandcast
