// SendQueue: what one session sends next. Control messages in a bounded queue ahead of media; one media frame
// being written and at most one pending; a strand session that missed a delta waits for the next keyframe.
// Plain logic without I/O or clock, network thread.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <variant>

#include "common/codec/frame_header.h"
#include "common/wire/messages.h"

namespace strandcast {

inline constexpr size_t kMaxQueuedControl = 64;

class SendQueue {
 public:
  enum class Offer {
    Queued,
    Ignored,    // not for this session now (no chain, or it has this state already)
    LostChain,  // could not be queued: pending was dropped, a keyframe is needed
  };
  using Item = std::variant<ServerMessage, EncodedFramePtr>;

  /// False when the queue is full: the session must be closed.
  [[nodiscard]] bool push_control(ServerMessage message);
  /// First media of a session; strand frames wait until it is written.
  void set_asset(EncodedFramePtr asset);
  /// From now on the session wants strand frames, beginning with a keyframe.
  void start_strands();
  Offer offer_strands(const EncodedFramePtr& frame);
  /// No more strand frames, and none that waits. False when the asset waited: it will not be sent.
  bool stop_strands();
  /// Latest wins; the replaced picture is counted in dropped_frames(). None is taken while a keyframe is
  /// waited for, which needs an empty pipe.
  void offer_picture(const EncodedFramePtr& frame);
  /// The client lost its state: forget the chain.
  void lose_chain();
  /// The frames of another class follow, beginning with a keyframe.
  void restart_strands();
  /// True when a keyframe would be queued at once; false while media is still being written.
  bool needs_keyframe() const;

  enum class Media { Allowed, Held };
  /// Removes what is sent next; control first, media only when allowed. Call written() when it is done,
  /// before the next one.
  std::optional<Item> take_next(Media media = Media::Allowed);
  void written();
  /// Drops everything not yet taken, for closing.
  void clear();

  uint64_t dropped_frames() const { return dropped_frames_; }
  uint64_t chain_losses() const { return chain_losses_; }

 private:
  enum class Chain { None, Waiting, Following };
  void drop_pending();

  std::deque<ServerMessage> control_;
  EncodedFramePtr pending_;
  bool is_pending_asset_ = false;
  bool is_writing_media_ = false;
  Chain chain_ = Chain::None;
  uint32_t chain_sequence_ = 0;  // last strand frame queued
  uint64_t dropped_frames_ = 0;
  uint64_t chain_losses_ = 0;
};

}  // namespace strandcast
