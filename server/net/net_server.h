// NetServer: one TCP port with HTTP (/healthz, /readyz, /metrics) and the WebSocket protocol of proto/WIRE.md
// at /v1. It has one network thread. Every public function may be called from any thread and never waits for
// a client. It does not simulate or encode, and the NetHandler decides what a session may see.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/pictures/picture.h"
#include "common/strands/frame_header.h"
#include "common/wire/close_code.h"
#include "common/wire/messages.h"
#include "server/net/net_config.h"
#include "server/net/stream_costs.h"
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
  /// A few strands by a codec of small keyframes, for the first picture over a thin link.
  struct Preview {
    StrandStream stream;
    std::string codec;
  };
  std::optional<Preview> preview = {};
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

/// Totals since start, except the first two.
struct NetCounters {
  uint64_t open_sessions = 0;    // WebSocket sessions, joined or not
  uint64_t joined_sessions = 0;  // after Welcome
  uint64_t connections = 0;
  uint64_t accept_errors = 0;
  uint64_t refused_full = 0;
  uint64_t refused_token = 0;
  uint64_t refused_rate = 0;  // too many connections of one address, and tokens after too many wrong ones
  uint64_t refused_tls = 0;   // failed TLS handshakes, and requests without TLS
  uint64_t refused_http = 0;  // wrong path, host, origin or request
  uint64_t bad_messages = 0;  // malformed, out of order, wrong role or too many
  uint64_t stalled = 0;       // dropped for a write without progress
  uint64_t timeouts = 0;      // no Hello or request in time
  uint64_t messages_received = 0;
  uint64_t unknown_messages = 0;  // of a kind that a later version may know; ignored
  uint64_t frames_sent = 0;
  uint64_t frames_dropped = 0;  // media a session was too slow for
  uint64_t chain_losses = 0;    // sessions that had to wait for a keyframe
  uint64_t keyframe_requests = 0;
  uint64_t class_changes = 0;  // of the strand class or picture step of a viewer
  uint64_t codec_changes = 0;  // of the codec of a viewer's strands
  uint64_t mode_changes = 0;   // between strands and frames
  uint64_t bytes_sent = 0;     // WebSocket payload
};

/// One head of a server; a session chooses its head in the Hello. Each head numbers its strand streams and
/// picture classes separately.
struct NetHead {
  std::string name;  // that a Hello asks for; a first head without one is asked for by any, and judges itself
  NetHandler* handler = nullptr;                                     // outlives the server
  std::vector<StrandClass> strand_classes = {StrandClass{}};         // at first; best first
  std::vector<StrandByteModel> strand_codecs = {StrandByteModel{}};  // that each of them is served by
};

class NetServer {
 public:
  /// Opens the port and closes it again, so that an error of listen() is known before a scene is built.
  static Status check_port(const NetConfig& config);
  /// Opens the port; connections wait until start(). A Hello without a name gets the first of `heads`, whose
  /// handler also answers for /metrics. Unavailable if the port is in use, BadInput for an invalid address,
  /// Unauthorized beyond loopback without a token.
  static Result<std::unique_ptr<NetServer>> listen(const NetConfig& config, std::vector<NetHead> heads);
  /// Opens the port for one unnamed head.
  static Result<std::unique_ptr<NetServer>> listen(const NetConfig& config, NetHandler& handler);
  /// Calls stop() if it was not called.
  ~NetServer();
  NetServer(const NetServer&) = delete;
  NetServer& operator=(const NetServer&) = delete;

  /// Starts the network thread. Call once.
  void start();
  uint16_t port() const;
  /// Reloads the certificate and key for new connections. After an error the previous ones stay.
  Status reload_tls();
  /// Replaces the tokens. Sessions end with a sentence if their token is missing or no longer permits their
  /// role. BadInput for an empty list where there were tokens.
  Status set_tokens(std::vector<AccessToken> tokens);

  // Each concerns the sessions of one head, by its number in `heads`.
  /// Renames a head. Sessions that join from now on select it by this name; an unnamed head other than the
  /// first cannot be selected.
  void name_head(size_t head, std::string name);
  /// Sends the strand frames of one stream (a class by a codec), in the order of their chain. A delta goes to
  /// sessions whose last frame is its base, a keyframe to those that wait for one.
  void publish_strands(EncodedFramePtr frame, size_t head = 0);
  /// Sends a session of this stream a keyframe and the deltas after it, oldest first, if it waits for a
  /// keyframe. Publish later frames of the chain only after this call.
  void send_chain(SessionId session, std::vector<EncodedFramePtr> chain);
  /// Sends the newest picture to the viewers of one class, replacing one that is not being sent yet. Each
  /// viewer gets the message that continues from its last picture.
  void publish_picture(PictureClass picture_class, PicturePtr picture, size_t head = 0);
  /// Changes the coding of strands: tells every viewer of strands, and moves those whose class is gone.
  /// `then` runs afterwards on the network thread, before any frame published later.
  void set_strand_classes(std::vector<StrandClass> classes, std::string reason, std::function<void()> then,
                          size_t head = 0);
  /// Changes the rest shape with the same number of vertices. Viewers of strands get this asset and then
  /// strands from a keyframe on; relays are asked to join again. `then` as above.
  void renew_asset(EncodedFramePtr asset, std::function<void()> then, size_t head = 0);
  /// Ends all sessions with a sentence that asks them to come back.
  void send_away(std::string reason, size_t head = 0);
  /// Begins another stream: ends all sessions with a sentence that asks them to come back. `then` as above.
  void begin_anew(std::vector<StrandClass> classes, std::vector<StrandByteModel> codecs, std::string reason,
                  std::function<void()> then, size_t head = 0);
  /// Sets the offset of the frames' clock from this machine's, for clients that measure it.
  void set_clock_offset(int64_t offset_ns);
  /// Sends a message to every joined session; dropped_frames of a ServerStatus is filled in per session.
  void broadcast(ServerMessage message, size_t head = 0);
  /// Sends every joined session the message that `of` returns for it, on the network thread.
  void tell_each(std::function<ServerMessage(SessionId)> of, size_t head = 0);
  /// Sends a message to the viewers of one picture class.
  void send_to_class(PictureClass picture_class, ServerMessage message, size_t head = 0);
  /// Sends a message to a session; ignored if it is gone.
  void send(SessionId session, ServerMessage message);
  /// Ends a session with a Goodbye and one sentence; ignored if it is gone.
  void close(SessionId session, CloseCode code, std::string reason);

  NetCounters counters() const;

  /// Sends Goodbye and close GoingAway to all for at most limits.close_ms, then ends the thread. Must not be
  /// called from a handler.
  void stop();

 private:
  struct State;
  explicit NetServer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace strandcast
