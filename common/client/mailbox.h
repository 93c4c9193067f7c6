// Mailbox: hands what the network thread received to the application thread; bounded in every kind. Strand
// frames keep their order (a delta needs every frame before it), and so do pictures that build on each other;
// whole pictures, assets, status, qualities, look and mode keep only the newest. Any thread. Does not decode.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "common/base/result.h"
#include "common/strands/frame_header.h"
#include "common/wire/messages.h"

namespace strandcast {

/// One received media message: asset, strand frame or picture. Its header was checked, its payload not.
struct MediaEvent {
  FrameHeader header;
  std::vector<std::byte> message;  // header + payload
  int64_t receive_time_ns = 0;     // client clock

  std::span<const std::byte> payload() const { return std::span(message).subspan(kFrameHeaderBytes); }
};

/// The last event of a connection, with the reason of its end.
struct ClosedEvent {
  Error error;
};

using ClientEvent =
    std::variant<MediaEvent, ServerStatus, Notice, StreamQuality, FrameQuality, ModeChange, SessionList,
                 LookChange, SceneText, ParameterList, CameraChange, StateTimes, StreamList, ClosedEvent>;

struct MailboxLimits {
  // Of strand frames, and as much of pictures that build on each other.
  size_t chained_frames = 240;            // four seconds at 60 Hz
  uint64_t chained_bytes = 128ull << 20;  // at least one message of the largest size fits
  size_t notices = 64;
  size_t parameter_lists = 16;
  size_t state_times = 4;  // two seconds
};

class Mailbox {
 public:
  explicit Mailbox(MailboxLimits limits = {}) : limits_(limits) {}

  enum class Outcome { Kept, KeyframeNeeded };

  /// Takes a media message. If strand frames exceed their limit, all of them are dropped, and so are deltas
  /// until the next keyframe. KeyframeNeeded tells the caller to request one. Pictures are treated in the
  /// same way.
  Outcome push(MediaEvent event);
  void push(const ServerStatus& status);
  void push(const StreamQuality& quality);
  void push(const SessionList& list);
  void push(const ModeChange& change);
  void push(const FrameQuality& quality);
  void push(const LookChange& look);
  void push(const SceneText& scene);
  void push(const CameraChange& camera);
  void push(const StreamList& streams);
  /// Takes a notice; the oldest is dropped if there are too many.
  void push(Notice notice);
  void push(ParameterList list);
  void push(StateTimes times);
  /// Adds the final event; later pushes are ignored.
  void close(Error error);

  /// Returns everything received since the last call, in order of arrival.
  std::vector<ClientEvent> take();
  /// Returns like take(), but waits up to `timeout` for the first event.
  std::vector<ClientEvent> wait(std::chrono::milliseconds timeout);
  /// Returns the oldest event alone, waiting up to `timeout`. For applications that need long for each event:
  /// the rest stays bounded, and newer statuses and pictures replace older ones.
  std::optional<ClientEvent> next(std::chrono::milliseconds timeout);

  /// Returns the number of frames and pictures that were dropped because the application was too slow.
  uint64_t dropped_frames() const;

 private:
  struct Lane;
  Outcome push_chained(MediaEvent event, Lane& lane);
  void leave_lane(const ClientEvent& event);
  template <class Predicate>
  size_t erase_media(Predicate predicate);
  template <class Event>
  void keep_newest(const Event& event);
  template <class Event>
  void keep_some(Event event, size_t limit);
  void append(ClientEvent event);

  const MailboxLimits limits_;
  mutable std::mutex mutex_;
  std::condition_variable arrived_;
  std::deque<ClientEvent> events_;
  struct Lane {  // frames that build on each other
    size_t frame_count = 0;
    uint64_t bytes = 0;
    bool is_waiting_for_keyframe = false;
  };
  Lane strands_;
  Lane pictures_;
  uint64_t dropped_frames_ = 0;
  bool is_closed_ = false;
};

}  // namespace strandcast
