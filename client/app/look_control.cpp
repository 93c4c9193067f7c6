#include "client/app/look_control.h"

#include <utility>

#include "client/app/look_form.h"

namespace strandcast {

void LookControl::follow(const LookChange& scene, bool is_steering) {
  scene_ = scene;
  if (is_steering && !std::exchange(is_steering_, is_steering)) own_.reset();
  is_steering_ = is_steering;
  if (!is_steering) held_.clear();
}

Status LookControl::edit(const std::vector<FormEdit>& edits, int64_t time_ns) {
  Status status;
  for (const FormEdit& edit : completed(shown(time_ns), edits)) {
    Result<LookDesc> changed = with_edits(shown(time_ns), {edit});
    if (!changed) {
      if (status) status = changed.error();
      continue;
    }
    if (is_steering_)
      held_[edit.path] = {edit.value, time_ns, false};
    else
      own_ = std::move(changed).value();
  }
  return status;
}

std::optional<std::string> LookControl::take_assignment(int64_t time_ns) {
  std::erase_if(held_, [&](const auto& entry) {
    return entry.second.is_sent && time_ns - entry.second.time_ns >= kLookHoldNs;
  });
  if (sent_ns_ != 0 && time_ns - sent_ns_ < kLookSendNs) return std::nullopt;
  std::vector<FormEdit> unsent;
  for (const auto& [path, held] : held_)
    if (!held.is_sent) unsent.push_back({path, held.value});
  if (unsent.empty()) return std::nullopt;
  last_sent_.clear();
  for (const FormEdit& edit : unsent) {
    held_[edit.path] = {edit.value, time_ns, true};
    last_sent_.push_back(edit.path);
  }
  sent_ns_ = time_ns;
  return look_assignment(unsent);
}

void LookControl::put_back() {
  for (const std::string& path : last_sent_)
    if (const auto held = held_.find(path); held != held_.end()) held->second.is_sent = false;
}

LookDesc LookControl::shown(int64_t time_ns) const {
  if (own_) return *own_;
  std::vector<FormEdit> edits;
  for (const auto& [path, held] : held_)
    if (!held.is_sent || time_ns - held.time_ns < kLookHoldNs) edits.push_back({path, held.value});
  const Result<LookDesc> look = with_edits(scene_.look, edits);
  return look ? *look : scene_.look;
}

FormState LookControl::form(bool are_frames, int64_t time_ns) const {
  FormState form;
  form.title = "Look";
  if (is_steering_) {
    form.notes.emplace_back("What you change here everybody sees.");
    form.save_note = "The whole scene as the server runs it, with this look and this view.";
  } else {
    form.notes.emplace_back(own_ ? "You see a look of your own. Nobody else does."
                                 : "What you change here you alone see: this viewer may not steer.");
    if (are_frames)
      form.notes.emplace_back("These are the server's pictures: a look of your own shows with strands (M).");
    form.save_note =
        "Look and view alone: a viewer that may not steer does not get the rest of the scene. All else has "
        "its "
        "default then.";
    if (own_) form.undo = "Back to the scene's";
  }
  form.fields = look_fields(shown(time_ns));
  form.file = file_;
  return form;
}

}  // namespace strandcast
