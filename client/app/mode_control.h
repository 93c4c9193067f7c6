// ModeControl: the mode that a viewer wants, was given and shows (strands or pictures). It is the only owner
// of this state in the client and outlives sessions. Any thread.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

#include "common/client/viewer_client.h"
#include "common/wire/messages.h"

namespace strandcast {

/// Snapshot of the mode's whole state.
struct ModeView {
  StreamMode wanted = StreamMode::Auto;    // by the person; Auto = the server chooses
  StreamMode given = StreamMode::Strands;  // as the server said last; never Auto
  StreamMode shown = StreamMode::Strands;  // of what was decoded last; never Auto
  std::string reason;                      // the server's, for a person
  bool is_answered = true;                 // the server has spoken since the wish
  uint64_t changes = 0;                    // of what is shown, in this session

  /// Describes the request and its outcome for a person: "frames, asking the server", "strands".
  std::string wish() const;
};

class ModeControl {
 public:
  explicit ModeControl(StreamMode wanted) { now_.wanted = wanted; }

  /// Sets the wanted mode for this session and later ones.
  void want(StreamMode mode);
  /// Returns the wanted mode once if this session's server has not been told; the caller must send it now.
  std::optional<StreamMode> take_request();
  /// Marks the last taken request as not sent.
  void give_back_request();

  /// Begins a session whose Hello asked for `asked`. Nothing has been shown yet; the next frame will be of
  /// the announced mode.
  void begin_session(StreamMode asked, const Welcome& welcome);
  void note_answer(ModeChange change);
  /// Notes that a frame of this mode was decoded; returns true if the previous one was of the other mode.
  bool note_shown(StreamMode mode);

  ModeView look() const;
  StreamMode shown() const;

 private:
  mutable std::mutex mutex_;
  ModeView now_;
  bool is_due_ = false;  // the wish is to be sent
};

/// Sends the wanted mode if the server has not been told. If sending fails, the next call tries again.
void send_mode_request(ModeControl& modes, ViewerClient& client);

}  // namespace strandcast
