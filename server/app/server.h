// Server: everything wired together: inputs, a source of states, the hub of the stream with its readers, the
// network. Several may live in one process. Threads and what they hand over: ARCHITECTURE.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "common/base/result.h"
#include "common/scene/scene_desc.h"
#include "server/app/record_desk.h"
#include "server/encode/picture_painter.h"
#include "server/input/input_hub.h"
#include "server/net/net_server.h"
#include "server/source/simulation_source.h"
#include "server/stream/stream_hub.h"

namespace strandcast {

struct ServerConfig;
/// For people: "anna, ben".
std::string names_of_heads(const SceneDesc& scene);
/// The scene's simulation.
Result<std::unique_ptr<StateSource>> simulation_source(const ServerConfig& config, InputHub& inputs);

struct ServerConfig {
  SceneDesc scene;
  NetConfig net;
  std::string sim_device = "auto";                     // as ExecutorConfig
  std::string gl_device = "auto";                      // as EglContext::make
  std::string renderer = "auto";                       // as RenderDeviceConfig
  std::optional<std::filesystem::path> shader_folder;  // none: the shaders in the binary
  SnapshotObserver on_publish;                         // may be empty; of every head
  bool is_lockstep = false;                            // simulated time goes on by commands only
  std::filesystem::path trace_path;                    // CSV of what each state took; empty = none
  std::function<MakePicturePainter(PainterConfig)> make_painter =
      device_picture_painter;  // of the frame thread, where the scene has one head
  /// Whether that painter takes processor cores: how large pictures may be, and what they are guessed to
  /// take.
  std::function<bool(const RenderDeviceConfig&)> is_drawn_by_processors = strandcast::is_drawn_by_processors;
  /// What feeds the stream of a head, whose scene alone it is given; its states have the scene's codec, bound
  /// and rate.
  std::function<Result<std::unique_ptr<StateSource>>(const ServerConfig&, InputHub&)> make_source =
      simulation_source;
  /// For viewers that cannot decode the scene's codec, instead of what that names itself.
  std::optional<std::string> fallback_codec;
  /// Who may send to the scene's live inputs besides this machine.
  std::vector<AddressRange> live_allowed;
  std::optional<RecordConfig> record;         // from the first state on
  std::optional<RecordFolder> record_folder;  // who controls may record into it
  StepTap* tap = nullptr;  // of the simulation from the first step on; set by the server where it records
};

struct ServerCounters {
  SimStats sim;
  NetCounters net;
  StrandEncodeCounters encode;  // of the first class by all codecs, medians of the slowest
  std::map<uint16_t, StrandEncodeCounters> strand_streams;  // all that were ever needed, by stream_id
  std::map<std::string, uint32_t> strand_viewers_of;        // by codec
  FrameCounters frames;
  InputCounters input;
  uint32_t strand_viewers = 0;  // readers of strands; one whose mode changes counts in frame_viewers too
  uint32_t frame_viewers = 0;
  uint32_t viewers = 0;
  uint32_t strand_classes_in_use = 0;
  bool is_slow = false;       // slow motion, now
  uint64_t slow_motions = 0;  // times that it began
  std::vector<LiveInputStatus> live_inputs;
  std::optional<RecordCounters> record;
};

class Server {
 public:
  /// Loads the scene, opens the port and GL, and serves. Every error is one sentence for a person.
  static Result<std::unique_ptr<Server>> start(const ServerConfig& config);
  /// stop(), if it was not called.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  uint16_t port() const;
  // Of one head, by its number; the scene's own is the first.
  /// For readers besides the network's sessions: a recorder, a relay.
  StreamHub& hub(size_t head = 0);
  ServerCounters counters(size_t head = 0) const;
  /// What all threads of the first head run now, and what they do not.
  gl::PassReports passes() const;
  /// As NetServer::reload_tls().
  Status reload_tls();
  /// As NetServer::set_tokens().
  Status set_tokens(std::vector<AccessToken> tokens);
  /// True once an admin has asked for the end: the owner calls stop().
  bool is_shut_down_wanted() const;
  /// Why the simulation ended by itself; nothing while all is well.
  std::optional<Error> failure() const;
  /// Says goodbye to all viewers and ends all threads; at most about net.limits.close_ms and one step.
  void stop();
  /// Returns after stop(), when an admin wants the end, or when the simulation ended by itself.
  void wait();

 private:
  class State;
  explicit Server(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace strandcast
