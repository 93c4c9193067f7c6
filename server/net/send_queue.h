// SendQueue: what one session sends next. Control messages in a bounded queue ahead of media; one media frame
// being written and at most one pending strand frame and one picture; a strand session that missed a delta
// waits for the next keyframe. More wait only behind a chain that a joiner is given, and for a relay, and not
// for long. Plain logic without I/O or clock, network thread.
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
/// A session is not read while so many wait: what it asked for before still finds room.
inline constexpr size_t kMostUnreadAnswers = kMaxQueuedControl / 4;
/// Strand frames that may wait for a relay: a second of them.
inline constexpr size_t kMaxRelayFrames = 60;
/// While a chain is given, so many new frames may go behind it for each of its own; then it must have gone
/// out.
inline constexpr size_t kCatchUpFrames = 2;

class SendQueue {
 public:
  enum class Offer {
    Queued,
    Ignored,    // not for this session now (no chain, or it has this state already)
    LostChain,  // could not be queued: pending was dropped, a keyframe is needed
  };
  using Item = std::variant<ServerMessage, EncodedFramePtr>;

  /// False when the queue is full: the session must be closed. A LookChange replaces one that waits.
  [[nodiscard]] bool push_control(ServerMessage message);
  size_t control_count() const { return control_.size(); }
  /// First media of a session; strand frames wait until it is written.
  void set_asset(EncodedFramePtr asset);
  /// Another asset in its place: what waits of the one before is dropped, and strands begin again behind it.
  void renew_asset(EncodedFramePtr asset);
  /// From now on the session wants strand frames, beginning with a keyframe.
  void start_strands();
  Offer offer_strands(const EncodedFramePtr& frame);
  /// A keyframe and the deltas after it, oldest first, for one that needs a keyframe; else ignored.
  Offer offer_chain(std::span<const EncodedFramePtr> chain);
  /// For a relay: all frames of the chain, and each keyframe that is made for others.
  void take_all() { takes_all_ = true; }
  /// No more strand frames, and none that waits. False when the asset waited: it will not be sent.
  bool stop_strands();
  /// From now on the session wants pictures, beginning with a whole one; again when those of another class
  /// follow or the client lost what it had. Strands go on until stop_strands().
  void start_pictures();
  /// No more pictures, and none that waits.
  void stop_pictures();
  /// The newest picture wins; the one it replaces is counted in dropped_frames(). LostChain when it needs the
  /// one before it and that was not sent.
  Offer offer_picture(const PicturePtr& picture);
  /// True until a whole picture comes.
  bool awaits_picture() const { return pictures_ == Pictures::Waiting; }
  /// True when a whole picture would be queued at once; false while media is still being written.
  bool needs_picture() const;
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
  bool put_behind(const EncodedFramePtr& frame);

  std::deque<ServerMessage> control_;
  EncodedFramePtr pending_;             // asset or strands
  std::deque<EncodedFramePtr> behind_;  // strands that follow it
  size_t catch_up_room_ = 0;            // new frames that may still go behind a chain
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
