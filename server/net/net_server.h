// NetServer: one TCP port with HTTP (/healthz, /readyz, /metrics) and the WebSocket protocol of proto/WIRE.md
// at /v1. One network thread; every public function may be called from any thread and never waits for a
// client. It does not simulate, encode pictures or strands, or decide what a session may see: that is the
// NetHandler's.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/net/tls_context.h"
#include "common/pictures/picture.h"
#include "common/strands/frame_header.h"
#include "common/wire/close_code.h"
#include "common/wire/messages.h"
#include "server/net/ip_address.h"
#include "server/net/roles.h"
#include "server/net/strand_class.h"
#include "server/net/stream_costs.h"

namespace strandcast {

inline constexpr uint32_t kMaxSessions = 256;
static_assert(kMaxSessions <= kMaxListedSessions);
inline constexpr uint32_t kMaxSessionsPerAddress = 64;

using SessionId = uint64_t;  // never reused by one server

/// Who says Hello.
struct Visitor {
  SessionId session = 0;
  std::string peer;  // what counts as one address, for shares
};

/// Limits of one session; tests shorten the times.
struct NetLimits {
  uint32_t sessions = kMaxSessions;
  uint32_t sessions_per_address = kMaxSessionsPerAddress;
  int64_t handshake_ms = 5'000;  // TCP accept to Hello, or to the end of another HTTP request
  int64_t idle_ms = 15'000;      // nothing received, pings included
  int64_t stalled_ms = 4'500;    // no progress of one write, or a viewer's silence once an answer is due
  int64_t unused_ms = 30'000;    // an acknowledgement is due, although the client sends other things
  int64_t keyframe_interval_ms = 250;  // between keyframes asked for one session
  int64_t close_ms = 2'000;            // for Goodbye and the closing handshake
  int64_t link_interval_ms = 250;      // between two looks at a link for the choice of its mode
  int64_t link_memory_ms = 30'000;     // a capacity that was seen says nothing about the link after this long
  double messages_per_s = 1'000.0;     // per session, and as many at once
  // Of one address, where it is not on trusted loopback.
  double connections_per_s = 10.0;  // and as many at once
  uint32_t wrong_tokens = 5;        // in wrong_token_window_ms; one more blocks
  int64_t wrong_token_window_ms = 60'000;
  int64_t wrong_token_block_ms = 60'000;    // no token is looked at from there
  uint32_t guarded_addresses = 1'024;       // remembered for this at once
  uint32_t refusal_lines_per_address = 10;  // in the log, a minute
  uint32_t refusal_lines = 300;             // of all addresses
  uint32_t session_lines = 1'200;           // about those who are in, of all
  double viewer_bytes_per_s = 0.0;          // cap of what a stream may take for one viewer; 0 = none
};

/// LikeAllOthers: behind a proxy or tunnel on this machine, where everybody seems to be local.
enum class LoopbackTrust { Trusted, LikeAllOthers };
/// Who may do without TLS when the server has a certificate.
enum class PlainAccess { TrustedLoopback, Nobody };

/// Whether trusted proxies begin each connection with a PROXY header.
enum class ProxyProtocol { None, Version2 };

struct NetConfig {
  std::string address = "127.0.0.1";  // numeric, or "localhost"
  uint16_t port = kDefaultPort;       // 0 = any free port
  std::vector<AccessToken> tokens;    // needed beyond loopback
  LoopbackTrust loopback_trust = LoopbackTrust::Trusted;
  std::optional<TlsFiles> tls;  // none: no TLS
  PlainAccess plain_access = PlainAccess::TrustedLoopback;
  std::vector<std::string>
      allowed_hosts;  // accepted in the Host header, besides the server's own address and name
  std::vector<std::string> allowed_origins;  // of web pages, besides this very server
  // Who may say for whom it connects; connections from there are never trusted for coming from loopback.
  std::vector<AddressRange> trusted_proxies;
  ProxyProtocol proxy_protocol = ProxyProtocol::None;
  NetLimits limits;
  std::vector<StrandClass> strand_classes = {StrandClass{}};  // at first; best first, index = stream_id
};

/// Answer to a Hello. Without an asset none is sent; strands or pictures follow by welcome.mode.
struct Admission {
  Welcome welcome;
  EncodedFramePtr asset;
  PictureClass picture_class = 0;  // of a viewer in frames mode
  // What each step of its ladder of picture classes costs against the first, best first.
  std::vector<double> picture_costs;
  size_t picture_step = 0;  // it starts with this one
};

/// What one session's link does, for choosing between strands and frames; 0 = unknown.
struct LinkState {
  StreamMode mode = StreamMode::Strands;  // of the frames it gets now
  double capacity_bytes_per_s = 0.0;
  double queue_delay_ms = 0.0;
  double round_trip_ms = 0.0;
  std::vector<double> strand_bytes_per_s;  // what each strand class takes; empty = unknown
};

/// A change of mode, or only an answer when the mode is the one the session has.
struct ModeSwitch {
  ModeChange change;
  EncodedFramePtr asset;           // for strands
  uint16_t strand_class = 0;       // to begin with
  PictureClass picture_class = 0;  // for frames, as in Admission
  std::vector<double> picture_costs;
  size_t picture_step = 0;
};

/// What the application does with sessions. Called on the network thread: return quickly, never wait.
class NetHandler {
 public:
  virtual ~NetHandler() = default;
  /// An error closes the session with its sentence: LimitExceeded as Full, Unavailable as TryLater,
  /// Unauthorized as Unauthorized, else Policy.
  virtual Result<Admission> on_hello(const Visitor& visitor, const Hello& hello) = 0;
  virtual void on_motion(SessionId session, const MotionSamples& samples, int64_t arrival_ns) = 0;
  virtual void on_wind(SessionId session, const WindSamples& samples, int64_t arrival_ns) = 0;
  virtual void on_command(SessionId session, const ControlCommand& command) = 0;
  virtual void on_parameter(SessionId session, const SetParameter& parameter) = 0;
  virtual void on_camera(SessionId session, const CameraChange& camera) = 0;
  virtual void on_ack(SessionId session, const FrameAck& ack) = 0;
  /// An admin wants the server to end.
  virtual void on_shut_down(SessionId) {}
  /// The session waits for a keyframe of this strand class given to publish_strands(). Repeated until one
  /// comes.
  virtual void on_keyframe_request(SessionId session, uint16_t stream_id) = 0;
  /// The session waits for a whole picture of its class: publish_picture() with the newest one, changed or
  /// not. Repeated until one comes.
  virtual void on_picture_request(SessionId, PictureClass /*picture_class*/) {}
  /// The link of a viewer of frames asks for another step of its ladder; false when it cannot have it.
  virtual bool on_picture_step(SessionId, size_t /*step*/, const std::string& /*reason*/) { return false; }
  /// The session now gets the frames of this strand class; it starts with the first one.
  virtual void on_strand_class(SessionId, uint16_t /*stream_id*/) {}
  virtual void on_report(SessionId, const ViewerReport&) {}
  virtual void on_mode_request(SessionId, const ModeRequest&) {}
  /// For every viewer, each limits.link_interval_ms.
  virtual void on_link(SessionId, const LinkState&, int64_t /*time_ns*/) {}
  /// A change of mode is done: the first frame of the new mode is next in line.
  virtual void on_mode(SessionId, StreamMode) {}
  /// Once for every session whose on_hello succeeded.
  virtual void on_left(SessionId session) = 0;
  /// The answer of /readyz: the simulation is stepping, or one sentence why not.
  virtual Status readiness() { return {}; }
  /// Lines added to /metrics, in Prometheus text form.
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
  uint64_t mode_changes = 0;   // between strands and frames
  uint64_t bytes_sent = 0;     // WebSocket payload
};

class NetServer {
 public:
  /// Opens the port; connections wait until start(). `handler` must outlive the server. Unavailable when the
  /// port is in use, BadInput for an address that is none, Unauthorized beyond loopback without a token.
  static Result<std::unique_ptr<NetServer>> listen(const NetConfig& config, NetHandler& handler);
  /// stop(), if it was not called.
  ~NetServer();
  NetServer(const NetServer&) = delete;
  NetServer& operator=(const NetServer&) = delete;

  /// Starts the network thread. Call once.
  void start();
  uint16_t port() const;
  /// Reads the certificate and the key again; new connections get them. On an error the old ones stay.
  Status reload_tls();

  /// Strand frames of one class (stream_id) in the order of their chain. A delta goes to sessions of the
  /// class whose last frame it builds on, a keyframe to those that wait for one.
  void publish_strands(EncodedFramePtr frame);
  /// The newest picture for the viewers of one class; replaces one not yet being sent. Each viewer gets what
  /// takes it there from the last one it was sent.
  void publish_picture(PictureClass picture_class, PicturePtr picture);
  void set_picture_class(SessionId session, PictureClass picture_class);
  /// Strands are coded otherwise from now on: tells every viewer of strands and moves those whose class is
  /// gone. `then` runs on the network thread after that, before any frame published later.
  void set_strand_classes(std::vector<StrandClass> classes, std::string reason, std::function<void()> then);
  /// The session gets frames of the old mode until the first one of the new mode is here; ModeChange goes
  /// right before that. With the mode it has, a change under way is given up and ModeChange sent at once.
  void change_mode(SessionId session, ModeSwitch change);
  /// To every joined session. In a ServerStatus dropped_frames is filled in per session.
  void broadcast(ServerMessage message);
  /// To those who watch the pictures of one class.
  void send_to_class(PictureClass picture_class, ServerMessage message);
  /// Ignored when the session is gone.
  void send(SessionId session, ServerMessage message);

  NetCounters counters() const;

  /// Goodbye and close GoingAway to all, at most limits.close_ms, then ends the thread. Not from a handler.
  void stop();

 private:
  struct State;
  explicit NetServer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace strandcast
