// SendQueue: what one session sends next. Control messages in a bounded queue ahead of media; one media frame
// being written and at most one pending strand frame and one picture; a strand session that missed a delta
// waits for the next keyframe. More wait only for a relay, after a chain that a joiner is given, and while a
// keyframe is written; not for long. Plain logic without I/O or clock, network thread.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <variant>

#include "common/pictures/picture.h"
#include "common/strands/frame_header.h"
#include "common/wire/messages.h"

namespace strandcast {

inline constexpr size_t kMaxQueuedControl = 64;
/// Number of waiting messages at which a session is not read, so that answers to earlier requests still find
/// room.
inline constexpr size_t kMostUnreadAnswers = kMaxQueuedControl / 4;
/// Largest number of strand frames that wait for a relay: one second.
inline constexpr size_t kMaxRelayFrames = 60;
/// Number of new frames that may queue after each frame of a chain while it is sent.
inline constexpr size_t kCatchUpFrames = 2;

/// Exact frames of so few bytes wait while a link stands still, two seconds of them: a keyframe would take
/// more, and the viewer steps twice as fast until it is there.
inline constexpr size_t kWaitingExactFrames = 120;
inline constexpr size_t kExactFrameBytes = 256;

class SendQueue {
 public:
  enum class Offer {
    Queued,
    Ignored,    // not for this session now (no chain, or it has this state already)
    LostChain,  // could not be queued: pending was dropped, a keyframe is needed
  };
  using Item = std::variant<ServerMessage, EncodedFramePtr>;

  /// Queues a control message; a LookChange replaces a waiting one. Returns false if the queue is full and
  /// the session must be closed.
  [[nodiscard]] bool push_control(ServerMessage message);
  size_t control_count() const { return control_.size(); }
  /// Sets the first media message; strand frames wait until it is written.
  void set_asset(EncodedFramePtr asset);
  /// Replaces the asset: drops waiting frames of the previous one; strands restart after it.
  void renew_asset(EncodedFramePtr asset);
  /// Starts strand frames, beginning with a keyframe.
  void start_strands();
  Offer offer_strands(const EncodedFramePtr& frame);
  /// Offers a keyframe and the deltas after it, oldest first; ignored unless the session needs a keyframe.
  Offer offer_chain(std::span<const EncodedFramePtr> chain);
  /// Makes the queue that of a relay: it takes all frames of the chain, and each keyframe made for others.
  void take_all() { takes_all_ = true; }
  /// Stops strand frames and drops waiting ones. Returns false if the asset was still waiting; it will not be
  /// sent.
  bool stop_strands();
  /// Starts pictures with a whole one; call it again for another class or after a loss at the client. Strands
  /// continue until stop_strands().
  void start_pictures();
  /// Stops pictures and drops a waiting one.
  void stop_pictures();
  /// Queues the newest picture; the one it replaces is counted in dropped_frames(). LostChain if its base was
  /// not sent.
  Offer offer_picture(const PicturePtr& picture);
  /// Returns true until a whole picture comes.
  bool awaits_picture() const { return pictures_ == Pictures::Waiting; }
  /// Returns true if a whole picture would be queued at once; false while media is still being written.
  bool needs_picture() const;
  /// Restarts the chain with a keyframe, because the client lost its state.
  void lose_chain();
  /// Begins the frames of another class with a keyframe.
  void restart_strands();
  /// Returns true if a keyframe would be queued at once; false while media is still being written.
  bool needs_keyframe() const;

  enum class Media { Allowed, Held };
  /// Removes the next message to send: control first, media only if allowed. Call written() when it was sent,
  /// before the next call.
  std::optional<Item> take_next(Media media = Media::Allowed);
  void written();
  /// Drops everything not yet taken, for closing.
  void clear();

  uint64_t dropped_frames() const { return dropped_frames_; }
  uint64_t chain_losses() const { return chain_losses_; }

 private:
  enum class Chain { None, Waiting, Following };
  void drop_pending();
  bool put_behind(const EncodedFramePtr& frame);

  std::deque<ServerMessage> control_;
  EncodedFramePtr pending_;             // asset or strands
  std::deque<EncodedFramePtr> behind_;  // strands that follow it
  size_t catch_up_room_ = 0;            // new frames that may still go behind a chain
  size_t keyframe_room_ = 0;            // bytes that may still go behind a keyframe: no more than another one
  bool takes_all_ = false;
  bool is_pending_asset_ = false;
  bool is_writing_media_ = false;
  Chain chain_ = Chain::None;
  uint32_t chain_sequence_ = 0;  // last strand frame queued
  enum class Pictures { None, Waiting, Following };
  Pictures pictures_ = Pictures::None;
  PicturePtr pending_picture_;
  uint32_t shown_picture_ = 0;  // sequence of the last one taken; 0 = none
  uint64_t dropped_frames_ = 0;
  uint64_t chain_losses_ = 0;
};

}  // namespace strandcast
