// ModeControl: which mode a viewer wants, was given and shows. The one place in the client that knows; it
// outlives sessions. Any thread.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

#include "common/client/viewer_client.h"
#include "common/wire/messages.h"

namespace strandcast {

/// All of it, as of one moment.
struct ModeView {
  StreamMode wanted = StreamMode::Auto;    // by the person; Auto = the server chooses
  StreamMode given = StreamMode::Strands;  // as the server said last; never Auto
  StreamMode shown = StreamMode::Strands;  // of what was decoded last; never Auto
  std::string reason;                      // the server's, for a person
  bool is_answered = true;                 // the server has spoken since the wish
  uint64_t changes = 0;                    // of what is shown, in this session

  /// What was asked for and what became of it: "frames, asking the server", "strands".
  std::string wish() const;
};

class ModeControl {
 public:
  explicit ModeControl(StreamMode wanted) { now_.wanted = wanted; }

  /// A person (or this machine) wants this mode from now on, in later sessions too.
  void want(StreamMode mode);
  /// The wish when the server of this session has not been told, once: whoever takes it sends it now.
  std::optional<StreamMode> take_request();
  /// What was taken could not be sent.
  void give_back_request();

  /// A session began with `asked` in its Hello: what it shows is yet to come, but nothing else will be.
  void begin_session(StreamMode asked, const Welcome& welcome);
  void note_answer(ModeChange change);
  /// A frame of this mode was decoded; true when the one before was of the other.
  bool note_shown(StreamMode mode);

  ModeView look() const;
  StreamMode shown() const;

 private:
  mutable std::mutex mutex_;
  ModeView now_;
  bool is_due_ = false;  // the wish is to be sent
};

/// Sends the wish if the server has not been told. What cannot be sent is asked again with the next call.
void send_mode_request(ModeControl& modes, ViewerClient& client);

}  // namespace strandcast
