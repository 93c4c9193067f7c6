// Control messages as domain types; protobuf types never leave common/wire. Decoding checks every field:
// finite numbers, ranges, counts, text. The only exception is the values of motion and wind samples. They are
// passed on unchecked, NaN included, because the server's input hub checks and counts them. No I/O. Sizes and
// versions: proto/WIRE.md. proto/schema.py makes the parts marked `schema` from proto/strandcast/v1.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "common/base/result.h"
#include "common/base/timecode.h"
#include "common/math/pose.h"
#include "common/pictures/picture.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

inline constexpr const char* kWebSocketProtocol = "strandcast.v1";
inline constexpr uint16_t kDefaultPort = 7878;
// schema begin: limits
// clang-format off
inline constexpr size_t kMaxControlBytes = 65'536;
inline constexpr uint32_t kMaxSamplesPerMessage = 256;
inline constexpr size_t kMaxNameChars = 64;  // names of clients, scenes, codecs, versions
inline constexpr size_t kMaxTextChars = 1024;  // reasons and notices
inline constexpr size_t kMaxTokenBytes = 256;
inline constexpr size_t kMaxAssignmentBytes = 4096;  // SetParameter
inline constexpr size_t kMaxSceneTextBytes = 61'440;
inline constexpr size_t kSessionIdChars = 16;
inline constexpr uint32_t kMaxRateDivisor = 64;
inline constexpr uint32_t kMaxListedSessions = 256;  // a full SessionList stays below kMaxControlBytes
inline constexpr size_t kMaxListedNameChars = 32;
inline constexpr size_t kMaxAddressChars = 64;
inline constexpr double kMaxReportedMs = 60'000.0;  // ViewerReport
inline constexpr double kMaxReportedPx = 100'000.0;
inline constexpr double kMaxReportedHz = 1000.0;
// a ServerStatus with kMaxLiveInputs full inputs stays below kMaxControlBytes
inline constexpr size_t kMaxLiveInputChars = 128;
inline constexpr size_t kMaxLiveSubjectsChars = 512;
inline constexpr size_t kMaxLiveValues = 16;
inline constexpr size_t kMaxLiveValueChars = 120;
inline constexpr double kMaxStepNs = 1'000'000.0;  // Hello
inline constexpr uint32_t kMaxStepCount = 100'000;  // ControlCommand
inline constexpr size_t kMaxSlateChars = 32;  // RecordCommand
inline constexpr uint32_t kMaxTake = 9999;
inline constexpr double kMaxBanS = 604'800.0;  // AdminCommand
inline constexpr uint32_t kMaxListedParameters = 64;  // a full ParameterList stays below kMaxControlBytes
inline constexpr size_t kMaxParameterPathBytes = 96;
inline constexpr size_t kMaxParameterTextBytes = 160;
inline constexpr uint32_t kMaxStateTimes = 512;  // full StateTimes stay below kMaxControlBytes
inline constexpr size_t kMaxRelays = 8;  // in a row
inline constexpr uint32_t kMaxListedClasses = 64;
inline constexpr size_t kMaxListedCodecs = 4;
inline constexpr double kMaxSolverCost = 1000.0;
// clang-format on
// schema end

struct MotionSamples {  // from a Source
  struct Sample {
    int64_t time_ns = 0;  // source clock, monotonic
    Pose world_from_head;
    std::vector<glm::vec3> joint_m = {};  // head space: of each of joint_names, or none
    bool operator==(const Sample&) const = default;
  };
  std::vector<Sample> samples;  // oldest first, at most kMaxSamplesPerMessage
  // How much slower than real time the source plays what it sends, to go with a slow simulation: 0 = not at
  // all (whatever is live), 0.75 = at a quarter of the speed, 1 = it stands still.
  double held_back = 0.0;
  // Of the body, at most kMaxMotionJoints of 1 .. kMaxJointNameBytes bytes, each once.
  std::vector<std::string> joint_names = {};
  std::optional<Timecode> timecode = {};  // of the first sample; without one, of the arrival
  bool operator==(const MotionSamples&) const = default;
};
struct WindSamples {  // from a Source
  struct Sample {
    int64_t time_ns = 0;           // source clock
    glm::vec3 velocity_mps{0.0f};  // world
    bool operator==(const Sample&) const = default;
  };
  std::vector<Sample> samples;
  bool operator==(const WindSamples&) const = default;
};

// schema begin: messages
// clang-format off
enum class Role { Viewer, Controller, Source, Admin };
enum class StreamMode { Strands, Frames, Auto };
enum class Command { Pause, Resume, StepOnce, Reset };
enum class AdminAction { ListSessions, Kick, ShutDown };
enum class DrawingDevice { Unknown, None, Software, Hardware };
enum class LiveAction { ChooseSubject, Calibrate, Reset };
/// First message; answered by Welcome or Goodbye.
struct Hello {
  Role role = Role::Viewer;  // a Controller views and may steer; a Source sends motion and wind; an Admin all
  StreamMode mode = StreamMode::Strands;
  std::string name = {};  // shown in logs, at most 64 characters
  std::string token = {};  // empty where the server has none
  uint32_t frame_width = 0;  // frames mode; 0 = server's choice
  uint32_t frame_height = 0;
  bool acknowledges = false;  // sends a FrameAck for every media message
  PictureCodecs picture_codecs = 0;  // bit 1 << PictureCodec
  bool gets_no_stream = false;  // neither strands nor frames
  double step_ns = 0.0;  // of one vertex in one solver step here, one thread; 0 = cannot predict
  std::string codec_wish = {};  // the only strand codec that it takes; empty = the server chooses
  bool keeps_camera = false;  // nobody else moves its camera
  std::string head = {};  // name of a head of the server; empty = the first
  std::string relay_id = {};  // of a relay: its session_id; empty = a viewer
  uint32_t strand_class = 0;  // of a relay: the class that it wants, by its place in the StreamList
  uint32_t asset_layout = 0;  // the newest that it takes; 0 = 1
  bool operator==(const Hello&) const = default;
};
/// A camera. To the server: where this viewer looks from; to a viewer: where it is to look from.
struct CameraChange {
  CameraDesc camera;
  bool operator==(const CameraChange&) const = default;
};
/// Asks for a frame that can be entered.
struct KeyframeRequest {
  bool operator==(const KeyframeRequest&) const = default;
};
/// Acknowledges a media message that was used.
struct FrameAck {
  uint32_t sequence = 0;
  int64_t receive_time_ns = 0;  // client clock
  uint32_t decode_us = 0;
  uint16_t stream_id = 0;  // of its header
  bool operator==(const FrameAck&) const = default;
};
/// Clock probe.
struct Ping {
  int64_t client_time_ns = 0;
  bool operator==(const Ping&) const = default;
};
/// Pauses, resumes, steps or resets the simulation; answered by a Notice.
struct ControlCommand {
  Command command = Command::Pause;
  // steps of COMMAND_STEP_ONCE, answered when done and published; 0 = one, answered at once
  uint32_t step_count = 0;
  bool operator==(const ControlCommand&) const = default;
};
/// Changes a field of the scene by its path ("solver.name=dftl"); answered by a Notice.
struct SetParameter {
  std::string assignment = {};
  bool operator==(const SetParameter&) const = default;
};
/// Lists sessions, ends one, or shuts the server down; answered by a SessionList or a Notice.
struct AdminCommand {
  AdminAction action = AdminAction::ListSessions;
  uint64_t session = 0;  // of a kick
  double ban_s = 0.0;  // of a kick: how long its address stays out
  bool operator==(const AdminCommand&) const = default;
};
/// About once a second: what this machine makes of what it gets; 0 = not measured.
struct ViewerReport {
  double decode_ms = 0.0;  // median per state of strands
  double draw_ms = 0.0;  // median per picture of strands, of the size that is drawn in motion
  double picture_decode_ms = 0.0;  // median per picture of the server's
  double shown_hz = 0.0;  // different pictures shown per second
  DrawingDevice device = DrawingDevice::Unknown;
  double hair_px = 0.0;  // of strands: how high the hair is on the screen; 0 = not told
  double step_ns = 0.0;  // as in Hello, of who could not predict then; 0 = as in Hello
  // since the Welcome: frames of strands, none missing before them, whose state was not the server's
  uint32_t wrong_states = 0;
  bool operator==(const ViewerReport&) const = default;
};
/// Asks for strands, pictures or the server's choice; answered by a ModeChange.
struct ModeRequest {
  StreamMode mode = StreamMode::Auto;
  bool operator==(const ModeRequest&) const = default;
};
/// Asks for the scene as it runs; answered by a SceneText or a Notice.
struct SceneRequest {
  bool operator==(const SceneRequest&) const = default;
};
/// Chooses or calibrates the subject of live motion capture; answered by a Notice.
struct LiveCommand {
  LiveAction action = LiveAction::ChooseSubject;
  // that drives the head from now on; empty = one named head, else the first one seen
  std::string subject = {};
  bool operator==(const LiveCommand&) const = default;
};
/// Asks for parameters of the scene; answered by a ParameterList.
struct ParameterRequest {
  std::string prefix = {};  // of the paths to list: "look.", "solver"; empty = all
  uint32_t first = 0;  // number of them that are left out
  bool is_watching = false;  // and again, with what is other, whenever something changes
  bool operator==(const ParameterRequest&) const = default;
};
/// Sets where other viewers look from; answered by a Notice.
struct CameraCommand {
  uint64_t session = 0;  // whose camera; 0 = of all viewers but the sender
  CameraDesc camera;
  bool operator==(const CameraCommand&) const = default;
};
/// Asks for StateTimes with every status, or for no more of them.
struct StateTimesRequest {
  bool is_wanted = true;  // from now on StateTimes come with every status, or no more
  bool operator==(const StateTimesRequest&) const = default;
};
/// Begins or ends a recording; answered by a Notice.
struct RecordCommand {
  bool is_wanted = true;  // to begin; false: to end the recording
  std::string name = {};  // of the file; empty = of slate and take, or the server's choice
  std::string slate = {};  // as on the clapperboard; empty = none
  uint32_t take = 0;  // of the slate; 0 = none
  bool operator==(const RecordCommand&) const = default;
};
/// How large the window is that shows the stream, and whether anybody can see it.
struct WindowChange {
  uint32_t frame_width = 0;  // of pictures from now on; 0 = as before
  uint32_t frame_height = 0;
  bool is_hidden = false;  // nobody sees it: nothing is drawn or sent for it
  bool operator==(const WindowChange&) const = default;
};
using ClientMessage =
    std::variant<Hello, MotionSamples, WindSamples, CameraChange, KeyframeRequest, FrameAck, Ping,
                 ControlCommand, SetParameter, AdminCommand, ViewerReport, ModeRequest, SceneRequest,
                 LiveCommand, ParameterRequest, CameraCommand, StateTimesRequest, RecordCommand,
                 WindowChange>;
/// Answer to a Hello.
struct Welcome {
  std::string session_id = {};  // 16 hex digits, new for every server start
  std::string server_version = {};
  std::string scene_name = {};
  StreamMode mode = StreamMode::Strands;  // what was chosen for `Auto`
  std::string mode_reason = {};
  std::string codec = {};  // of strands, until a StreamQuality names another
  std::string codec_reason = {};  // for a person: why this one
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;
  float bound_m = 0.0f;  // announced Euclidean error
  double step_rate_hz = 60.0;
  LookDesc look;
  CameraDesc camera;
  uint32_t frame_width = 0;
  uint32_t frame_height = 0;
  std::string sim_device = {};  // for a person: what simulates; empty = nothing does
  Role role = Role::Viewer;  // as granted
  // names of all that the server has, the first first; none where it has one
  std::vector<std::string> heads = {};
  // session_id of each on the way, from the one at the server that simulates
  std::vector<std::string> relays = {};
  bool operator==(const Welcome&) const = default;
};
/// Answer to a Ping.
struct Pong {
  int64_t client_time_ns = 0;  // echoed
  int64_t server_receive_ns = 0;
  int64_t server_send_ns = 0;
  bool operator==(const Pong&) const = default;
};
struct LiveValue {
  std::string text = {};
  bool operator==(const LiveValue&) const = default;
};
/// A live input: what its sender says, and how well it comes.
struct LiveInputStatus {
  std::string input = {};  // for a person
  std::string sender = {};  // address and port; empty = nobody sends
  std::string subject = {};  // that drives the head; empty = none yet
  std::string subjects = {};  // all that were seen lately, for a person
  bool is_stale = true;  // nothing of the subject for a second
  bool is_calibrated = false;
  double rate_hz = 0.0;  // packets
  double jitter_ms = 0.0;  // of their arrival
  double age_ms = 0.0;  // of the newest
  uint64_t packets = 0;
  uint64_t received_bytes = 0;
  uint64_t malformed = 0;
  uint64_t refused = 0;  // of senders that may not, or while another one is heard
  uint64_t over_rate = 0;  // more than a source may send
  uint64_t impossible = 0;  // poses that are no numbers, or no rotation
  uint64_t clamped = 0;  // poses that were faster than a head
  uint64_t gated = 0;  // poses not believed: the body was somewhere else at once
  uint64_t resequenced = 0;  // put back into their order
  uint64_t late = 0;  // came twice, or too late to be used
  uint64_t lost = 0;  // numbers of frames that never came
  std::vector<LiveValue> values = {};  // of the last packet, as it was sent
  bool operator==(const LiveInputStatus&) const = default;
};
/// About twice a second to every viewer.
struct ServerStatus {
  uint64_t tick = 0;
  double sim_ms = 0.0;  // median per step
  double encode_ms = 0.0;
  double render_ms = 0.0;  // 0 when nothing is rendered
  double realtime_factor = 0.0;  // simulated over wall time, last second
  bool is_paused = false;
  bool is_motion_stale = true;  // no motion sample for kMotionStaleS
  uint32_t viewer_count = 0;
  uint64_t dropped_frames = 0;  // for this client
  uint64_t rejected_samples = 0;  // motion and wind samples refused so far
  double queue_delay_ms = 0.0;  // how long data for this client waits on its way; 0 = unknown
  uint64_t quarantined_strands = 0;  // without usable numbers
  uint64_t overstretched_strands = 0;  // stretched too far
  std::string slow_motion = {};  // for a person: how slow, and the cheapest ways out; empty = real time
  std::vector<PictureMotion> picture_motions = {};
  std::string detail = {};  // for a person: how much is simulated, and why not all of it; empty = all
  std::vector<LiveInputStatus> live_inputs = {};  // at most kMaxLiveInputs
  std::string recording = {};  // for a person: the file that is written; empty = none
  std::optional<Timecode> timecode{};  // of the newest state; none where nobody counts
  double away_s = 0.0;  // a relay's: how long its server has been away; 0 = it is there
  bool operator==(const ServerStatus&) const = default;
};
/// The server closes right after it.
struct Goodbye {
  std::string reason = {};  // one sentence
  bool operator==(const Goodbye&) const = default;
};
/// Answer to SetParameter and ControlCommand, or a warning.
struct Notice {
  bool is_error = false;
  std::string text = {};
  uint64_t tick = 0;  // of the answer to counted steps: where the simulation is now
  uint64_t state_hash = 0;  // and the hash of that state
  bool operator==(const Notice&) const = default;
};
/// How strands are coded for this viewer from the next keyframe on.
struct StreamQuality {
  uint16_t stream_id = 0;  // of the frames it is about
  uint32_t rate_divisor = 1;  // at most one frame in that number of steps
  float strand_share = 1.0f;  // in (0, 1]
  float bound_m = 0.0f;  // Euclidean error
  std::string reason = {};  // for a person
  std::string codec = {};  // of these frames; empty = as before
  bool operator==(const StreamQuality&) const = default;
};
/// How pictures are made for this viewer from the next whole one on.
struct FrameQuality {
  uint16_t stream_id = 0;  // of the frames it is about
  uint32_t width = 0;
  uint32_t height = 0;
  double rate_hz = 0.0;  // at most
  uint32_t quality = 0;  // 1..100, as in JPEG
  PictureCodec codec = PictureCodec::Jpeg;
  std::string reason = {};  // for a person
  bool operator==(const FrameQuality&) const = default;
};
struct SessionInfo {
  uint64_t id = 0;
  std::string name = {};  // shortened to kMaxListedNameChars
  std::string address = {};  // of the peer, without its port
  Role role = Role::Viewer;
  StreamMode mode = StreamMode::Strands;
  uint64_t sent_bytes = 0;
  double queue_delay_ms = 0.0;  // as in ServerStatus
  double connected_s = 0.0;
  bool operator==(const SessionInfo&) const = default;
};
/// Answer to an AdminCommand.
struct SessionList {
  std::vector<SessionInfo> sessions = {};  // at most kMaxListedSessions
  bool operator==(const SessionList&) const = default;
};
/// What the client gets from the next frame on, and why.
struct ModeChange {
  StreamMode mode = StreamMode::Strands;  // never Auto
  std::string reason = {};  // for a person
  uint32_t frame_width = 0;
  uint32_t frame_height = 0;
  bool operator==(const ModeChange&) const = default;
};
/// What the scene looks like from now on, and its own camera.
struct LookChange {
  LookDesc look;
  CameraDesc camera;
  bool operator==(const LookChange&) const = default;
};
/// The scene as it runs.
struct SceneText {
  std::string text = {};  // as in a scene file, in one line
  bool operator==(const SceneText&) const = default;
};
struct ParameterInfo {
  std::string path = {};  // as in an assignment
  std::string value = {};  // as in a scene file
  std::string unset_value = {};  // where the scene does not say; empty = none
  std::string unit = {};  // empty = no dimension, or no number
  bool has_range = false;
  double minimum = 0.0;
  double maximum = 0.0;
  bool is_live = false;  // can be changed while the server runs
  std::string note = {};  // for a person
  bool operator==(const ParameterInfo&) const = default;
};
/// Answer to a ParameterRequest.
struct ParameterList {
  std::vector<ParameterInfo> parameters = {};  // at most kMaxListedParameters
  uint32_t total = 0;  // with that prefix
  bool is_change = false;  // no answer: these have other values now
  bool operator==(const ParameterList&) const = default;
};
/// When a state was where on its way through the server; server clock, 0 = not known.
struct StateTime {
  uint64_t tick = 0;
  int64_t sim_time_ns = 0;  // simulation time
  int64_t source_ns = 0;  // when its newest motion sample was made
  int64_t motion_ns = 0;  // when that arrived
  int64_t published_ns = 0;  // when it was simulated
  int64_t encoded_ns = 0;  // when its first frame of strands was encoded
  std::optional<Timecode> timecode{};  // of the motion that it shows; none where nobody counts
  bool operator==(const StateTime&) const = default;
};
/// When each new state was where on its way.
struct StateTimes {
  std::vector<StateTime> states = {};  // at most kMaxStateTimes, oldest first
  bool operator==(const StateTimes&) const = default;
};
/// Streams for a relay, after its Welcome and when they change: all there are.
struct StreamList {
  struct Class {
    uint32_t rate_divisor = 1;  // at most one frame in that number of steps
    float strand_share = 1.0f;  // in (0, 1]: of the strands, the first ones
    uint32_t coarsening = 1;  // lattice steps per step of the published lattice
    float bound_m = 1e-4f;  // announced Euclidean error
    double frame_rate_hz = 60.0;
    bool operator==(const Class&) const = default;
  };
  std::vector<Class> classes = {};  // best first
  std::vector<std::string> codecs = {};  // that each is served by
  std::string reason = {};
  std::string solver = {};
  double solver_cost = 0.0;
  uint32_t substeps = 1;
  bool operator==(const StreamList&) const = default;
};
using ServerMessage =
    std::variant<Welcome, Pong, ServerStatus, Goodbye, Notice, StreamQuality, FrameQuality, SessionList,
                 ModeChange, LookChange, SceneText, ParameterList, CameraChange, StateTimes, StreamList>;
// clang-format on
// schema end

/// Serialises a message: an opcode byte (Control), then protobuf. Messages within their limits take at most
/// kMaxControlBytes. Names, reasons and notices are shortened to their limits; unprintable characters become
/// spaces or '?'.
std::vector<std::byte> encode(const ClientMessage& message);
std::vector<std::byte> encode(const ServerMessage& message);

/// Inverse of encode() for untrusted bytes. BadInput and LimitExceeded name the field; Unsupported means that
/// the caller should ignore the message.
Result<ClientMessage> decode_client_message(std::span<const std::byte> bytes);
Result<ServerMessage> decode_server_message(std::span<const std::byte> bytes);

/// Describes for a person the codec of a viewer's strands and why it was chosen; older servers give no
/// reason.
std::string codec_text(const Welcome& welcome);
const char* to_string(StreamMode mode);
const char* to_string(Role role);
const char* to_string(DrawingDevice device);

}  // namespace strandcast
