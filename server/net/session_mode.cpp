// The part of Session that follows its subscription, and changes between strands and frames without a gap:
// the old frames go on until the first new one is here.
#include <algorithm>
#include <utility>

#include "common/base/profile.h"
#include "common/log/log.h"
#include "server/net/session_private.h"

namespace strandcast::net {

bool Session::watches(PictureClass picture_class) const {
  return state_ == State::Joined && !subscription_.is_empty() && subscription_.watches(picture_class);
}

/// The pictures of another class begin with a whole one.
void Session::follow_picture_class(PictureClass before) {
  if (subscription_.pictures.picture_class == before || !subscription_.gets(StreamMode::Frames)) return;
  queue_.start_pictures();
  account_drops();
  ask_for_keyframe(now_ns());
}

/// What was begun for the next mode stops.
void Session::give_up_mode_change() {
  if (std::exchange(untold_change_, std::nullopt)) stop_other_mode();
}

void Session::stop_other_mode() {
  if (subscription_.mode() == StreamMode::Strands)
    queue_.stop_pictures();
  else if (!queue_.stop_strands())
    has_asset_ = false;
}

void Session::answer_mode(const ModeAnswer& answer) {
  if (state_ != State::Joined || subscription_.is_empty()) return;
  if (!subscription_.next()) {
    give_up_mode_change();
    return queue_control(answer.change);
  }
  untold_change_ = answer.change;
  if (subscription_.changes_to(StreamMode::Frames)) {
    queue_.start_pictures();
  } else {
    if (!std::exchange(has_asset_, true)) queue_.set_asset(answer.asset);
    queue_.start_strands();
  }
  ask_for_keyframe(now_ns());
  pump();
}

/// Called when a frame of the new mode is here: the old ones stop, and the client is told right before it.
void Session::finish_mode_switch() {
  if (!untold_change_) return;
  const ModeChange change = *std::exchange(untold_change_, std::nullopt);
  const int64_t time_ns = now_ns();
  subscription_.finish_change();
  flow_.start_over(time_ns);
  stop_other_mode();
  context_.count(&NetCounters::mode_changes);
  context_.note(fmt::format("session {} gets {}: {}", id_, to_string(subscription_.mode()), change.reason));
  head().handler.on_change(id_, SubscriptionChange::Mode);
  queue_control(change);
  if (subscription_.mode() == StreamMode::Frames || state_ != State::Joined) return;
  announce_quality(to_string(head().strands.classes()[subscription_.strands.strand_class]));
}

}  // namespace strandcast::net
