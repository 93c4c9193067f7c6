// NetServer: one TCP port with HTTP (/healthz, /readyz, /metrics) and the WebSocket protocol of proto/WIRE.md
// at /v1. One network thread; every public function may be called from any thread and never waits for a
// client. It does not simulate, encode pictures or strands, or decide what a session may see: that is the
// NetHandler's.
#pragma once

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
#include "server/net/net_handler.h"
#include "server/net/stream_costs.h"

namespace strandcast {

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

/// One of the heads that a server has: what a session is about from its Hello on. Its strands and its classes
/// of pictures are numbered by themselves.
struct NetHead {
  std::string name;  // that a Hello asks for; a first head without one is asked for by any, and judges itself
  NetHandler* handler = nullptr;                                     // outlives the server
  std::vector<StrandClass> strand_classes = {StrandClass{}};         // at first; best first
  std::vector<StrandByteModel> strand_codecs = {StrandByteModel{}};  // that each of them is served by
};

class NetServer {
 public:
  /// Opens the port and closes it again: what listen() would refuse is told before a scene is built.
  static Status check_port(const NetConfig& config);
  /// Opens the port; connections wait until start(). `heads`: who names none in the Hello gets the first,
  /// whose handler also answers for /metrics. Unavailable when the port is in use, BadInput for an address
  /// that is none, Unauthorized beyond loopback without a token.
  static Result<std::unique_ptr<NetServer>> listen(const NetConfig& config, std::vector<NetHead> heads);
  /// With one head, which has no name.
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
  /// Who joins from now on needs one of these, and sessions whose token is not among them, or is good for
  /// less now, end with a sentence. BadInput for none where there were some.
  Status set_tokens(std::vector<AccessToken> tokens);

  // Each concerns the sessions of one head, by its number in `heads`.
  /// Who joins from now on asks for it by this name; for one without a name, but the first, nobody can.
  void name_head(size_t head, std::string name);
  /// Strand frames of one stream (a class by a codec) in the order of their chain. A delta goes to sessions
  /// of the stream whose last frame it builds on, a keyframe to those that wait for one.
  void publish_strands(EncodedFramePtr frame, size_t head = 0);
  /// Of the stream that a session gets: a keyframe and the deltas after it, oldest first, if it waits for a
  /// keyframe. Frames published before are not among those that go on from there.
  void send_chain(SessionId session, std::vector<EncodedFramePtr> chain);
  /// The newest picture for the viewers of one class; replaces one not yet being sent. Each viewer gets what
  /// takes it there from the last one it was sent.
  void publish_picture(PictureClass picture_class, PicturePtr picture, size_t head = 0);
  /// Strands are coded otherwise from now on: tells every viewer of strands and moves those whose class is
  /// gone. `then` runs on the network thread after that, before any frame published later.
  void set_strand_classes(std::vector<StrandClass> classes, std::string reason, std::function<void()> then,
                          size_t head = 0);
  /// Strands have another shape at rest, and as many vertices: viewers of strands get this asset, and strands
  /// from a keyframe on; relays are asked to join again. `then` as above.
  void renew_asset(EncodedFramePtr asset, std::function<void()> then, size_t head = 0);
  /// Another stream begins: all who are there go with this sentence, to come back. `then` as above.
  void begin_anew(std::vector<StrandClass> classes, std::vector<StrandByteModel> codecs, std::string reason,
                  std::function<void()> then, size_t head = 0);
  /// Of the clock that frames are stamped with against this machine's, for those who measure it.
  void set_clock_offset(int64_t offset_ns);
  /// To every joined session. In a ServerStatus dropped_frames is filled in per session.
  void broadcast(ServerMessage message, size_t head = 0);
  /// Likewise, what `of` gives for each of them, on the network thread.
  void tell_each(std::function<ServerMessage(SessionId)> of, size_t head = 0);
  /// To those who watch the pictures of one class.
  void send_to_class(PictureClass picture_class, ServerMessage message, size_t head = 0);
  /// Ignored when the session is gone.
  void send(SessionId session, ServerMessage message);
  /// Goodbye with one sentence. Ignored when the session is gone.
  void close(SessionId session, CloseCode code, std::string reason);

  NetCounters counters() const;

  /// Goodbye and close GoingAway to all, at most limits.close_ms, then ends the thread. Not from a handler.
  void stop();

 private:
  struct State;
  explicit NetServer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace strandcast
