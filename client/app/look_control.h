// LookControl: what a person does to the look of the hair. Whoever may steer changes the scene's look, which
// all viewers see; anybody else gives this window a look of its own. Pure logic on given times, one thread.
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

/// A slider that is dragged is sent this often, as it stands then.
inline constexpr int64_t kLookSendNs = 100'000'000;
/// So long what a person did is shown although the server has not said it yet; then what it says counts.
inline constexpr int64_t kLookHoldNs = 1'000'000'000;
inline constexpr const char* kSceneFile = "out/scene.textproto";

class LookControl {
 public:
  /// The newest of the server, and whether this session may steer it.
  void follow(const LookChange& scene, bool is_steering);
  /// The error names what is wrong with an edit; the others count.
  Status edit(const std::vector<FormEdit>& edits, int64_t time_ns);
  /// Takes a look of one's own back.
  void undo() { own_.reset(); }
  void set_file(std::string file) { file_ = std::move(file); }

  /// What SetParameter is to say now.
  std::optional<std::string> take_assignment(int64_t time_ns);
  /// It did not go out: again with the next.
  void put_back();

  /// Drawn here instead of the scene's; nothing: the scene's.
  const std::optional<LookDesc>& own_look() const { return own_; }
  bool is_steering() const { return is_steering_; }
  const std::string& file() const { return file_; }
  /// As it stands in the panel: with what was done and the server has not said yet.
  LookDesc shown(int64_t time_ns) const;
  /// `are_frames`: the server's pictures are seen, not strands drawn here.
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
