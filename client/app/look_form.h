// The panel of the look: a form of a look's fields as common/scene/scene_fields.h lists them, so that new
// fields appear automatically, and what becomes of a person's changes in it. No window.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/window/form.h"
#include "common/base/result.h"
#include "common/scene/scene_desc.h"
#include "common/wire/messages.h"

namespace strandcast {

/// Returns every field of the look, grouped by section.
std::vector<FormField> look_fields(const LookDesc& look);

/// Adds the edits that a person expects to come with the given ones: custom colours start from the colours
/// now seen.
std::vector<FormEdit> completed(const LookDesc& seen, std::vector<FormEdit> edits);

/// Returns the assignment "look={ ... }" that sets exactly these fields by SetParameter. There must be at
/// least one edit.
std::string look_assignment(const std::vector<FormEdit>& edits);

/// Returns the look after these edits, checked like a scene file.
Result<LookDesc> with_edits(const LookDesc& look, const std::vector<FormEdit>& edits);

/// Interval at which the value of a dragged slider is sent.
inline constexpr int64_t kLookSendNs = 100'000'000;
/// Time for which an edit is shown without the server's confirmation; after it the server's value is shown.
inline constexpr int64_t kLookHoldNs = 1'000'000'000;
inline constexpr const char* kSceneFile = "out/scene.textproto";

/// Handles a person's changes to the look of the hair. A session that may steer changes the scene's look,
/// which all viewers see; any other changes only the look in this window. On given times, one thread.
class LookControl {
 public:
  /// Takes the server's newest look and whether this session may steer it.
  void follow(const LookChange& scene, bool is_steering);
  /// Applies edits. The error names an invalid edit; the others are applied.
  Status edit(const std::vector<FormEdit>& edits, int64_t time_ns);
  /// Discards this window's own look.
  void undo() { own_.reset(); }
  void set_file(std::string file) { file_ = std::move(file); }

  /// Returns the next assignment to send by SetParameter.
  std::optional<std::string> take_assignment(int64_t time_ns);
  /// Returns the last assignment to the queue because it could not be sent; it goes out with the next one.
  void put_back();

  /// Returns the look drawn here instead of the scene's; empty: the scene's look is drawn.
  const std::optional<LookDesc>& own_look() const { return own_; }
  bool is_steering() const { return is_steering_; }
  const std::string& file() const { return file_; }
  /// Returns the look shown in the panel, including edits that the server has not confirmed yet.
  LookDesc shown(int64_t time_ns) const;
  /// Returns the form of the panel; `are_frames`: the window shows the server's pictures instead of strands
  /// drawn here.
  FormState form(bool are_frames, int64_t time_ns) const;

 private:
  struct Held {
    FormValue value;
    int64_t time_ns = 0;
    bool is_sent = false;
  };

  LookChange scene_;
  bool is_steering_ = false;
  std::optional<LookDesc> own_;
  std::map<std::string, Held> held_;  // by path
  std::vector<std::string> last_sent_;
  int64_t sent_ns_ = 0;  // 0 = never
  std::string file_ = kSceneFile;
};

}  // namespace strandcast
