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

/// The application's reactions to sessions. Called on the network thread, so functions must return quickly
/// without waiting.
class NetHandler {
 public:
  virtual ~NetHandler() = default;
  /// Decides on a Hello. An error closes the session with its sentence: LimitExceeded as Full, Unavailable as
  /// TryLater, Unauthorized as Unauthorized, else Policy.
  virtual Result<Admission> on_hello(const Visitor& visitor, const Hello& hello) = 0;
  virtual void on_motion(SessionId session, const MotionSamples& samples, int64_t arrival_ns) = 0;
  virtual void on_wind(SessionId session, const WindSamples& samples, int64_t arrival_ns) = 0;
  virtual void on_command(SessionId session, const ControlCommand& command) = 0;
  virtual void on_parameter(SessionId session, const SetParameter& parameter) = 0;
  virtual void on_scene_request(SessionId) {}
  virtual void on_live_command(SessionId, const LiveCommand&) {}
  virtual void on_parameter_request(SessionId, const ParameterRequest&) {}
  /// Handles a command about others' cameras; a CameraChange sent to a session also moves its pictures.
  virtual void on_camera_command(SessionId, const CameraCommand&) {}
  virtual void on_state_times_request(SessionId, const StateTimesRequest&) {}
  virtual void on_record_command(SessionId, const RecordCommand&) {}
  /// Handles a viewer's camera; it may change the class of the subscription's pictures.
  virtual void on_camera(SessionId session, const CameraChange& camera) = 0;
  /// Handles an admin's request to shut down the server.
  virtual void on_shut_down(SessionId) {}
  /// Reports that the session waits for a keyframe of this strand stream, to be given to publish_strands().
  /// Repeated until one comes.
  virtual void on_keyframe_request(SessionId session, uint16_t stream_id) = 0;
  /// Reports that a relay, which follows the chain, needs a keyframe for its joiners.
  virtual void on_anchor_request(SessionId session, uint16_t stream_id) {
    on_keyframe_request(session, stream_id);
  }
  /// Reports that the session waits for a whole picture: publish_picture() with the newest one, changed or
  /// not. Repeated until one comes.
  virtual void on_picture_request(SessionId, PictureClass /*picture_class*/) {}
  /// Asks for another step of a viewer's quality ladder, because of its link. Puts the step and its class
  /// into the subscription; returns false if it is unavailable.
  virtual bool on_picture_step(SessionId, size_t /*step*/, const std::string& /*reason*/) { return false; }
  /// Reports that the session has put another strand class into its subscription.
  virtual void on_strand_class(SessionId) {}
  virtual void on_report(SessionId, const ViewerReport&) {}
  virtual void on_mode_request(SessionId, const ModeRequest&) {}
  /// Checks a viewer's link, every limits.link_interval_ms and immediately after on_mode_request(). A change
  /// of mode that it begins is stored in the subscription.
  virtual LinkAnswer on_link(SessionId, const LinkState&, int64_t /*time_ns*/) { return {}; }
  /// Reports that a change of mode is complete: the first frame of the new mode is next.
  virtual void on_mode(SessionId) {}
  /// Reports once that a session has left whose on_hello() succeeded.
  virtual void on_left(SessionId session) = 0;
  /// Returns the answer of /readyz: success if the simulation is stepping, otherwise the reason in one
  /// sentence.
  virtual Status readiness() { return {}; }
  /// Returns further lines for /metrics, as Prometheus text.
  virtual std::string metrics() { return {}; }
};

}  // namespace strandcast
