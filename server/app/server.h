// Server: connects all parts: inputs, a source of states, the stream hub with its readers, and the network.
// Several servers may live in one process. Threads and the data that they exchange: ARCHITECTURE.md.
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
#include "server/app/head_sender.h"
#include "server/app/record_manager.h"
#include "server/app/stage_clock.h"
#include "server/encode/picture_painter.h"
#include "server/input/input_hub.h"
#include "server/net/net_server.h"
#include "server/source/simulation_source.h"
#include "server/stream/stream_hub.h"

namespace strandcast {

struct ServerConfig;
/// Returns the heads' names for a person, for example "anna, ben".
std::string names_of_heads(const SceneDesc& scene);
/// Makes the source that simulates the scene.
Result<std::unique_ptr<StateSource>> simulation_source(const ServerConfig& config, InputHub& inputs);

struct ServerConfig {
  SceneDesc scene;
  NetConfig net;
  std::string sim_device = "auto";                     // as ExecutorConfig
  std::string gl_device = "auto";                      // as EglContext::make
  std::string renderer = "auto";                       // as RenderDeviceConfig
  std::optional<std::filesystem::path> shader_folder;  // none: the shaders in the binary
  SnapshotObserver on_publish;                         // may be empty; of every head
  std::optional<Timecode> timecode;  // how this machine's clock counts where nobody does; empty = not at all
  StageClock clock;                  // which it is
  bool is_lockstep = false;          // simulated time goes on by commands only
  std::filesystem::path trace_path;  // CSV of what each state took; empty = none
  std::function<MakePicturePainter(PainterConfig)> make_painter =
      device_picture_painter;  // of the frame thread, where the scene has one head
  /// Returns whether the painter uses processor cores; this decides the largest picture size and the guessed
  /// drawing time.
  std::function<bool(const RenderDeviceConfig&)> is_drawn_by_processors = strandcast::is_drawn_by_processors;
  /// Makes the source of a head's stream from the configuration of that head alone. Its states must have the
  /// scene's codec, bound and rate.
  std::function<Result<std::unique_ptr<StateSource>>(const ServerConfig&, InputHub&)> make_source =
      simulation_source;
  /// Codec for viewers that cannot decode the scene's codec, instead of that codec's own fallback.
  std::optional<std::string> fallback_codec;
  /// Addresses, besides this machine, that may send to the scene's live inputs.
  std::vector<AddressRange> live_allowed;
  std::vector<HeadSend> sends;                // programs that follow the heads
  std::optional<RecordConfig> record;         // from the first state on
  std::optional<RecordFolder> record_folder;  // who controls may record into it
  StepTap* tap = nullptr;  // of the simulation from the first step on; set by the server where it records
  SharedSlot* shared = nullptr;  // of the head; set by the server
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
  /// Loads the scene, opens the port and GL, and starts serving. Every error is one sentence for a person.
  static Result<std::unique_ptr<Server>> start(const ServerConfig& config);
  /// Calls stop() if it was not called.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  uint16_t port() const;
  // Of one head, by its number; the scene's own is the first.
  /// Returns the stream of a head, for readers other than network sessions, such as a recorder or a relay.
  StreamHub& hub(size_t head = 0);
  ServerCounters counters(size_t head = 0) const;
  /// Returns the passes of all threads of the first head, including those that do not run.
  gl::PassReports passes() const;
  /// Does what NetServer::reload_tls() does.
  Status reload_tls();
  /// Does what NetServer::set_tokens() does.
  Status set_tokens(std::vector<AccessToken> tokens);
  /// Returns true once an admin has requested the shutdown; the owner must then call stop().
  bool is_shut_down_wanted() const;
  /// Returns why the simulation ended by itself; empty while it runs.
  std::optional<Error> failure() const;
  /// Returns why a recording ended before the server did, for example a full disk; empty while it is whole.
  std::optional<Error> recording_failure() const;
  /// Says goodbye to all viewers and ends all threads. Takes at most about net.limits.close_ms and one step.
  void stop();
  /// Returns after stop(), when an admin requests the shutdown, or when the simulation ends by itself.
  void wait();

 private:
  class State;
  explicit Server(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace strandcast
