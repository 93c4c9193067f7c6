// The part of Session that changes between strands and frames without a gap: the old frames go on until the
// first new one is here.
#include <algorithm>
#include <utility>

#include "common/base/profile.h"
#include "common/log/log.h"
#include "server/net/session_private.h"

namespace strandcast::net {

bool Session::watches(PictureClass picture_class) const {
  if (state_ != State::Joined || hello_.role == Role::Source) return false;
  if (mode_ == StreamMode::Frames) return picture_class == picture_class_;
  return changes_to(StreamMode::Frames) && picture_class == next_mode_->picture_class;
}

void Session::set_picture_class(PictureClass picture_class) {
  const bool is_next = changes_to(StreamMode::Frames);
  PictureClass& present = is_next ? next_mode_->picture_class : picture_class_;
  if (std::exchange(present, picture_class) == picture_class) return;
  if (!is_next && mode_ != StreamMode::Frames) return;
  guarded([&] {
    queue_.start_pictures();
    account_drops();
    ask_for_keyframe(now_ns());
  });
}

void Session::change_mode(const ModeSwitch& change) {
  if (state_ != State::Joined || hello_.role == Role::Source) return;
  guarded([&] {
    if (change.change.mode == mode_) {
      if (std::exchange(next_mode_, std::nullopt)) {
        if (mode_ == StreamMode::Strands)
          queue_.stop_pictures();
        else if (!queue_.stop_strands())
          has_asset_ = false;
      }
      return queue_control(change.change);
    }
    next_mode_ = change;
    if (change.change.mode == StreamMode::Frames) {
      queue_.start_pictures();
    } else {
      strand_class_ =
          static_cast<uint16_t>(std::min<size_t>(change.strand_class, context_.strands.classes().size() - 1));
      context_.handler.on_strand_class(id_, strand_class_);
      if (!std::exchange(has_asset_, true)) queue_.set_asset(change.asset);
      queue_.start_strands();
    }
    ask_for_keyframe(now_ns());
    pump();
  });
}

/// Called when a frame of the new mode is here: the old ones stop, and the client is told right before it.
void Session::finish_mode_switch() {
  if (!next_mode_) return;
  const ModeSwitch next = *std::exchange(next_mode_, std::nullopt);
  const int64_t time_ns = now_ns();
  mode_ = next.change.mode;
  flow_.start_over(time_ns);
  if (mode_ == StreamMode::Strands) {
    queue_.stop_pictures();
  } else {
    picture_class_ = next.picture_class;
    picture_costs_ = next.picture_costs;
    picture_step_ = next.picture_step;
    if (!queue_.stop_strands()) has_asset_ = false;
  }
  context_.count(&NetCounters::mode_changes);
  context_.note(fmt::format("session {} gets {}: {}", id_, to_string(mode_), next.change.reason));
  context_.handler.on_mode(id_, mode_);
  queue_control(next.change);
  if (mode_ == StreamMode::Frames || state_ != State::Joined) return;
  announce_quality(to_string(context_.strands.classes()[strand_class_]));
}

}  // namespace strandcast::net
