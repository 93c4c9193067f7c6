// Subscription: what one viewer gets: strands or pictures, of which class, and the change in progress. It is
// the only place with this state: the application chooses, the session follows and reports when a change is
// done. Plain data and logic; network thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/wire/messages.h"
#include "server/net/strand_class.h"
#include "server/net/stream_costs.h"

namespace strandcast {

/// Pictures that a viewer gets, and the quality ladder of those that it could get.
struct PictureChoice {
  PictureClass picture_class = 0;
  std::vector<double> costs;  // of each step of the ladder against the first, best first
  size_t step = 0;            // of the ladder
};

class Subscription {
 public:
  StrandStream strands;
  PictureChoice pictures;

  /// Returns whether the viewer gets nothing, as a source or a client that only sends commands.
  bool is_empty() const { return is_empty_; }
  /// Returns what the viewer gets now: Strands or Frames.
  StreamMode mode() const { return mode_; }
  /// Returns the mode that the viewer changes to; the present one continues until the first frame of the next
  /// is ready.
  std::optional<StreamMode> next() const { return next_; }
  int64_t changing_since_ns() const { return changing_since_ns_; }
  /// Returns whether nobody sees the viewer's window: it then gets nothing, whatever its mode is.
  bool is_hidden() const { return is_hidden_; }
  void set_hidden(bool is_hidden) { is_hidden_ = is_hidden; }
  bool gets(StreamMode kind) const { return !is_empty_ && (mode_ == kind || next_ == kind); }
  bool changes_to(StreamMode kind) const { return next_ == kind; }
  bool watches(PictureClass picture_class) const {
    return !is_hidden_ && gets(StreamMode::Frames) && picture_class == pictures.picture_class;
  }

  /// Begins the subscription before all else; a viewer that gets nothing here never gets anything.
  void begin(const Hello& hello) { is_empty_ = hello.role == Role::Source || hello.gets_no_stream; }
  /// Sets the first mode, before anything is sent.
  void start_with(StreamMode mode) { mode_ = mode; }
  void begin_change(StreamMode next, int64_t time_ns) {
    next_ = next;
    changing_since_ns_ = time_ns;
  }
  void give_up_change() { next_.reset(); }
  /// Completes the change, because the first frame of the next mode is ready.
  void finish_change() {
    mode_ = next_.value_or(mode_);
    next_.reset();
  }

 private:
  bool is_empty_ = false;
  bool is_hidden_ = false;
  StreamMode mode_ = StreamMode::Strands;
  std::optional<StreamMode> next_;
  int64_t changing_since_ns_ = 0;
};

}  // namespace strandcast
