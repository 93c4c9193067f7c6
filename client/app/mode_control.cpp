#include "client/app/mode_control.h"

#include <utility>

namespace strandcast {

std::string ModeView::wish() const {
  const std::string name = to_string(wanted);
  if (!is_answered) return name + ", asking the server";
  if (wanted == StreamMode::Auto || wanted == shown) return name;
  return name + (given == wanted ? ", not here yet" : ", not to be had");
}

void ModeControl::want(StreamMode mode) {
  const std::lock_guard lock(mutex_);
  now_.wanted = mode;
  now_.is_answered = false;
  is_due_ = true;
}

std::optional<StreamMode> ModeControl::take_request() {
  const std::lock_guard lock(mutex_);
  if (!std::exchange(is_due_, false)) return std::nullopt;
  return now_.wanted;
}

void ModeControl::give_back_request() {
  const std::lock_guard lock(mutex_);
  is_due_ = true;
}

void ModeControl::begin_session(StreamMode asked, const Welcome& welcome) {
  const std::lock_guard lock(mutex_);
  now_.given = now_.shown = welcome.mode;
  now_.reason = welcome.mode_reason;
  now_.changes = 0;
  // The Welcome answers the Hello; a wish that came later is still to be told.
  is_due_ = asked != now_.wanted;
  now_.is_answered = !is_due_;
}

void ModeControl::note_answer(ModeChange change) {
  const std::lock_guard lock(mutex_);
  now_.given = change.mode;
  now_.reason = std::move(change.reason);
  now_.is_answered = !is_due_;
}

bool ModeControl::note_shown(StreamMode mode) {
  const std::lock_guard lock(mutex_);
  if (std::exchange(now_.shown, mode) == mode) return false;
  ++now_.changes;
  return true;
}

ModeView ModeControl::look() const {
  const std::lock_guard lock(mutex_);
  return now_;
}

void send_mode_request(ModeControl& modes, ViewerClient& client) {
  const auto request = modes.take_request();
  if (request && !client.send(ModeRequest{*request})) modes.give_back_request();
}

StreamMode ModeControl::shown() const {
  const std::lock_guard lock(mutex_);
  return now_.shown;
}

}  // namespace strandcast
