// A started server with a small scene, and the product's own viewers of it: for tests of the whole product in
// one process.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/app/ctl_commands.h"
#include "client/app/viewer_session.h"
#include "server/app/server.h"
#include "tests/support/eventually.h"
#include "tests/support/lacks_gl.h"

namespace strandcast::test {

/// The built-in scene with few strands.
inline SceneDesc small_scene(uint32_t strand_count = 150, uint32_t vertex_count = 8) {
  SceneDesc scene = built_in_scene();
  ProceduralGroomDesc groom;
  groom.strand_count = strand_count;
  groom.vertex_count = vertex_count;
  scene.groom = groom;
  scene.stream.frame_width = 64;
  scene.stream.frame_height = 48;
  return scene;
}

/// The same without a head: nothing to draw but hair, and an asset that is small against the stream.
inline SceneDesc bald_scene(uint32_t strand_count = 150, uint32_t vertex_count = 8) {
  SceneDesc scene = small_scene(strand_count, vertex_count);
  scene.head.is_visible = false;
  return scene;
}

class ServerFixture : public testing::Test {
 protected:
  /// False when the test is over: the server failed to start, or the test is skipped for want of OpenGL.
  [[nodiscard]] bool start(ServerConfig config) {
    begin(std::move(config));
    return server_ != nullptr;
  }
  [[nodiscard]] bool start(const SceneDesc& scene) {
    ServerConfig config;
    config.scene = scene;
    return start(std::move(config));
  }

  void TearDown() override {
    if (server_ == nullptr) return;
    EXPECT_FALSE(server_->failure());
    server_->stop();
  }

  /// A relay's port instead of the server's where it is given.
  ClientConfig client_config(StreamMode mode = StreamMode::Strands, Role role = Role::Viewer,
                             uint16_t port = 0) const {
    ClientConfig config;
    config.address = {"127.0.0.1", port != 0 ? port : server_->port()};
    config.hello.role = role;
    config.hello.mode = mode;
    config.hello.name = "test";
    return config;
  }

  static std::unique_ptr<ViewerSession> open(const ClientConfig& config) {
    auto session = ViewerSession::open(config);
    if (session) return std::move(session).value();
    ADD_FAILURE() << session.error().to_string();
    return nullptr;
  }

  /// What strandcast-ctl is told with --connect.
  CtlTarget ctl_target() const {
    CtlTarget target;
    target.connect = "127.0.0.1:" + std::to_string(server_->port());
    return target;
  }

  /// Pumps the sessions in turn until the condition holds; false after a generous time or an error.
  template <class Condition>
  [[nodiscard]] static bool pump_until(const std::vector<ViewerSession*>& sessions, Condition condition) {
    Status pumped;
    const bool is_done = eventually([&] {
      for (ViewerSession* session : sessions)
        if (pumped) pumped = session->pump(std::chrono::milliseconds(5));
      return !pumped || condition();
    });
    if (!pumped) ADD_FAILURE() << pumped.error().to_string();
    return is_done && pumped.ok();
  }

  std::unique_ptr<Server> server_;

 private:
  void begin(ServerConfig config) {
    config.net.port = 0;
    auto server = Server::start(config);
    if (!server && lacks_gl(server.error().message))
      GTEST_SKIP() << "needs OpenGL 4.5: " << server.error().to_string();
    ASSERT_TRUE(server) << server.error().to_string();
    server_ = std::move(server).value();
  }
};

}  // namespace strandcast::test
