// NetHandler: what an application does with the sessions of a NetServer, and what the two tell each other.
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

/// Who says Hello.
struct Visitor {
  SessionId session = 0;
  std::string peer;            // what counts as one address, for shares
  std::string address;         // for the log
  Subscription& subscription;  // the session's; valid until on_left()
};

/// Answer to a Hello. Without an asset none is sent; strands or pictures follow by the subscription, which
/// also fills in the mode of the Welcome.
struct Admission {
  Welcome welcome;
  EncodedFramePtr asset;
};

/// What one session's link does, for choosing between strands and frames; 0 = unknown.
struct LinkState {
  StreamMode mode = StreamMode::Strands;  // of the frames it gets now
  size_t strand_class = 0;                // of its strands, if it gets any
  double capacity_bytes_per_s = 0.0;
  double queue_delay_ms = 0.0;
  double round_trip_ms = 0.0;
  std::vector<double> strand_bytes_per_s;  // what each strand class takes by its codec; empty = unknown
};

/// What a viewer is told about its mode. When its subscription is changing, right before the first frame of
/// the other mode; otherwise at once, and a change that was under way is given up.
struct ModeAnswer {
  ModeChange change;
  EncodedFramePtr asset;  // for a change to strands
};

/// Another codec for the strands that a session gets, or will get.
struct CodecAnswer {
  size_t codec = 0;  // of those that are served
  std::string name;
  std::string reason;
};

/// What comes of a look at a link.
struct LinkAnswer {
  std::optional<ModeAnswer> mode;
  std::optional<CodecAnswer> codec;
  bool is_request_waiting = false;  // a ModeRequest has not had its turn: look again soon
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
  virtual void on_scene_request(SessionId) {}
  virtual void on_live_command(SessionId, const LiveCommand&) {}
  virtual void on_parameter_request(SessionId, const ParameterRequest&) {}
  /// Where others look from: a CameraChange sent to a session moves its pictures, too.
  virtual void on_camera_command(SessionId, const CameraCommand&) {}
  virtual void on_state_times_request(SessionId, const StateTimesRequest&) {}
  virtual void on_record_command(SessionId, const RecordCommand&) {}
  /// May change the class of the subscription's pictures.
  virtual void on_camera(SessionId session, const CameraChange& camera) = 0;
  /// An admin wants the server to end.
  virtual void on_shut_down(SessionId) {}
  /// The session waits for a keyframe of this stream of strands given to publish_strands(). Repeated until
  /// one comes.
  virtual void on_keyframe_request(SessionId session, uint16_t stream_id) = 0;
  /// A relay, which follows the chain, wants one for those who join there.
  virtual void on_anchor_request(SessionId session, uint16_t stream_id) {
    on_keyframe_request(session, stream_id);
  }
  /// The session waits for a whole picture of its class: publish_picture() with the newest one, changed or
  /// not. Repeated until one comes.
  virtual void on_picture_request(SessionId, PictureClass /*picture_class*/) {}
  /// The link of a viewer of frames asks for another step of its ladder: puts it and its class into the
  /// subscription; false when it cannot have it.
  virtual bool on_picture_step(SessionId, size_t /*step*/, const std::string& /*reason*/) { return false; }
  /// The session has put another strand class into its subscription.
  virtual void on_strand_class(SessionId) {}
  virtual void on_report(SessionId, const ViewerReport&) {}
  virtual void on_mode_request(SessionId, const ModeRequest&) {}
  /// For every viewer, each limits.link_interval_ms, and at once after on_mode_request(). A change that it
  /// begins stands in the subscription.
  virtual LinkAnswer on_link(SessionId, const LinkState&, int64_t /*time_ns*/) { return {}; }
  /// A change of mode is done: the first frame of the new mode is next in line.
  virtual void on_mode(SessionId) {}
  /// Once for every session whose on_hello succeeded.
  virtual void on_left(SessionId session) = 0;
  /// The answer of /readyz: the simulation is stepping, or one sentence why not.
  virtual Status readiness() { return {}; }
  /// Lines added to /metrics, in Prometheus text form.
  virtual std::string metrics() { return {}; }
};

}  // namespace strandcast
