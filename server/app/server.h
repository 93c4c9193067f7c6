// Server: everything wired together: input hub, simulation, encode and frame threads, network. Several may
// live in one process. Threads and what they hand over: ARCHITECTURE.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/scene/scene_desc.h"
#include "server/app/sim_loop.h"
#include "server/encode/frame_worker.h"
#include "server/encode/picture_painter.h"
#include "server/encode/strand_encode_worker.h"
#include "server/input/input_hub.h"
#include "server/net/net_server.h"

namespace strandcast {

struct ServerConfig {
  SceneDesc scene;
  NetConfig net;
  std::string gl_device = "auto";                      // as EglContext::make
  std::optional<std::filesystem::path> shader_folder;  // none: the shaders in the binary
  SnapshotObserver on_publish;                         // may be empty
  std::function<MakePicturePainter(GlPainterConfig)> make_painter =
      gl_picture_painter;  // of the frame thread
};

struct ServerCounters {
  SimStats sim;
  NetCounters net;
  StrandEncodeCounters encode;                       // of the first class
  std::vector<StrandEncodeCounters> strand_classes;  // all that were ever needed, by stream_id
  FrameCounters frames;
  InputCounters input;
  uint32_t strand_viewers = 0;  // one whose mode changes counts here and in frame_viewers
  uint32_t frame_viewers = 0;
  uint32_t viewers = 0;
  uint32_t strand_classes_in_use = 0;
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
  ServerCounters counters() const;
  /// As NetServer::reload_tls().
  Status reload_tls();
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
