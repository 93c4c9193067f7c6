// NetHandler: interface of the application for the sessions of a NetServer, and the data that the two
// exchange.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/strands/frame_header.h"
#include "common/wire/messages.h"
#include "server/net/net_config.h"
#include "server/net/subscription.h"

namespace strandcast {

/// The client that says Hello.
struct Visitor {
  SessionId session = 0;
  std::string peer;            // what counts as one address, for shares
  std::string address;         // for the log
  Subscription& subscription;  // the session's; valid until on_left()
};

/// Answer to a Hello. Without an asset none is sent. The subscription decides strands or pictures and fills
/// in the mode of the Welcome.
struct Admission {
  Welcome welcome;
  EncodedFramePtr asset;
};

/// Measurements of one session's link, for choosing between strands and pictures; 0 = unknown.
struct LinkState {
  StreamMode mode = StreamMode::Strands;  // of the frames it gets now
  size_t strand_class = 0;                // of its strands, if it gets any
  double capacity_bytes_per_s = 0.0;
  double queue_delay_ms = 0.0;
  double round_trip_ms = 0.0;
  std::vector<double> strand_bytes_per_s;  // what each strand class takes by its codec; empty = unknown
};

/// Answer to a viewer about its mode. If its subscription is changing, it is sent before the first frame
/// of the new mode. Otherwise it is sent at once, and a change in progress is cancelled.
struct ModeAnswer {
  ModeChange change;
  EncodedFramePtr asset;  // for a change to strands
};

/// Change of the codec of a session's present or future strands.
struct CodecAnswer {
  size_t codec = 0;  // of those that are served
  std::string name;
  std::string reason;
};

/// Result of NetHandler::on_link().
struct LinkAnswer {
  std::optional<ModeAnswer> mode;
  std::optional<CodecAnswer> codec;
  bool is_request_waiting = false;  // a ModeRequest has not had its turn: look again soon
};

/// What a session waits for; asked again until it comes.
struct StreamNeed {
  enum class Kind {
    Keyframe,  // of this strand stream, to be given to publish_strands()
    Anchor,    // the same for a relay's joiners: the relay itself follows the chain
    Picture,   // a whole one, changed or not: publish_picture() with the newest
  };
  Kind kind = Kind::Keyframe;
  uint16_t stream_id = 0;          // of strands
  PictureClass picture_class = 0;  // of a Picture
};

/// What has become of a session's subscription.
enum class SubscriptionChange {
  Strands,  // it has another class or codec of strands
  Mode,     // a change of mode is complete: the first frame of the new mode is next
};

/// One visitor of a variant, made of a lambda per alternative.
template <class... Ts>
struct Overloaded : Ts... {
  using Ts::operator()...;
};
template <class... Ts>
Overloaded(Ts...) -> Overloaded<Ts...>;  // Clang 14 needs it said

/// The application's reactions to sessions. Called on the network thread, so functions must return quickly
/// without waiting.
class NetHandler {
 public:
  virtual ~NetHandler() = default;
  /// Decides on a Hello. An error closes the session with its sentence: LimitExceeded as Full, Unavailable as
  /// TryLater, Unsupported as Refused, Unauthorized and NotFound as such, else Policy.
  virtual Result<Admission> on_hello(const Visitor& visitor, const Hello& hello) = 0;
  /// Handles what a session says after its Hello, when its role may say it. The network answers Ping,
  /// FrameAck and KeyframeRequest itself, and AdminCommand except ShutDown. A CameraChange or WindowChange
  /// may change the class of the subscription's pictures, a WindowChange whether it is hidden. After a
  /// ModeRequest on_link() follows immediately.
  virtual void on_message(SessionId session, const ClientMessage& message, int64_t arrival_ns) = 0;
  virtual void on_need(SessionId session, const StreamNeed& need) = 0;
  virtual void on_change(SessionId, SubscriptionChange) {}
  /// Asks for another step of a viewer's quality ladder, because of its link. Puts the step and its class
  /// into the subscription; returns false if it is unavailable.
  virtual bool on_picture_step(SessionId, size_t /*step*/, const std::string& /*reason*/) { return false; }
  /// Checks a viewer's link, every limits.link_interval_ms and immediately after a ModeRequest. A change
  /// of mode that it begins is stored in the subscription.
  virtual LinkAnswer on_link(SessionId, const LinkState&, int64_t /*time_ns*/) { return {}; }
  /// Reports once that a session has left whose on_hello() succeeded.
  virtual void on_left(SessionId session) = 0;
  /// Returns the answer of /readyz: success if the simulation is stepping, otherwise the reason in one
  /// sentence.
  virtual Status readiness() { return {}; }
  /// Returns further lines for /metrics, as Prometheus text.
  virtual std::string metrics() { return {}; }
};

}  // namespace strandcast
