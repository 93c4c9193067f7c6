// Length and curls of the hair on a running server: who is there already gets the other shape, and goes on.
#include <gmock/gmock.h>

#include <cmath>

#include "client/app/live_connection.h"
#include "server/relay/relay.h"
#include "tests/support/server_fixture.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::hair_shape_test {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

class HairShape : public test::ServerFixture {
 protected:
  ServerConfig config(const char* codec = "step") const {
    ServerConfig config;
    config.scene = test::small_scene(60, 8);
    config.scene.stream.codec = codec;
    config.scene.stream.has_codec = true;
    config.sim_device = "lanes";
    return config;
  }
  int change(const std::string& assignment) { return run_command(ctl_target(), SetParameter{assignment}); }

  static double length_m(const ViewerSession& session, uint32_t strand) {
    const SceneAsset& asset = *session.asset();
    double sum_m = 0.0;
    for (uint32_t i = 1; i < asset.vertex_count; ++i)
      sum_m += glm::distance(asset.rest_position_m[i * asset.strand_count + strand],
                             asset.rest_position_m[(i - 1) * asset.strand_count + strand]);
    return sum_m;
  }
  /// Of the newest state.
  static double shown_length_m(ViewerSession& session, uint32_t strand) {
    const Snapshot& state = *session.replay().newest();
    const size_t vertices = size_t{state.strand_count} * state.vertex_count;
    const auto point = [&](uint32_t vertex) {
      glm::dvec3 at;
      for (size_t axis = 0; axis < 3; ++axis)
        at[static_cast<int>(axis)] = static_cast<double>(state.quantum_m) *
                                     state.lattice[axis * vertices + vertex * state.strand_count + strand];
      return at;
    };
    double sum_m = 0.0;
    for (uint32_t i = 1; i < state.vertex_count; ++i) sum_m += glm::distance(point(i), point(i - 1));
    return sum_m;
  }
  /// Whether what is shown has this share of these lengths, to 2 % of a strand.
  static bool has_lengths(ViewerSession& session, const std::vector<double>& usual_m, double share) {
    for (uint32_t s = 0; s < usual_m.size(); ++s) {
      if (std::abs(length_m(session, s) - share * usual_m[s]) > 0.01 * usual_m[s]) return false;
      if (std::abs(shown_length_m(session, s) - share * usual_m[s]) > 0.02 * usual_m[s]) return false;
    }
    return true;
  }
  static std::vector<double> lengths_m(const ViewerSession& session) {
    std::vector<double> all;
    for (uint32_t s = 0; s < session.asset()->strand_count; ++s) all.push_back(length_m(session, s));
    return all;
  }
};

TEST_F(HairShape, WhoWatchesGetsTheOtherLengthAndGoesOn) {
  for (const char* codec : {"step", "tangent", "delta"}) {
    SCOPED_TRACE(codec);
    if (!start(config(codec))) return;
    auto viewer = open(client_config());
    ASSERT_TRUE(viewer);
    ASSERT_TRUE(pump_until({viewer.get()}, [&] { return viewer->has_picture(); }));
    const std::vector<double> usual_m = lengths_m(*viewer);
    EXPECT_TRUE(has_lengths(*viewer, usual_m, 1.0));
    // To and fro, as a slider goes.
    for (const double length : {0.5, 1.4, 0.3, 1.0}) {
      const uint64_t decoded = viewer->decoded_frames();
      EXPECT_EQ(change(fmt::format("hair.length={}", length)), kDoneExit);
      EXPECT_TRUE(pump_until({viewer.get()}, [&] { return has_lengths(*viewer, usual_m, length); }))
          << length;
      EXPECT_TRUE(pump_until({viewer.get()}, [&] { return viewer->decoded_frames() > decoded + 20; }));
    }
    EXPECT_EQ(viewer->replay().stats().rejected_frames, 0u) << viewer->replay().stats().last_error;
    server_->stop();
  }
}

TEST_F(HairShape, StaysThroughAResetAndAnotherQuality) {
  if (!start(config())) return;
  auto viewer = open(client_config());
  ASSERT_TRUE(viewer);
  ASSERT_TRUE(pump_until({viewer.get()}, [&] { return viewer->has_picture(); }));
  const std::vector<double> usual_m = lengths_m(*viewer);
  EXPECT_EQ(change("hair.length=0.5"), kDoneExit);
  EXPECT_EQ(run_command(ctl_target(), ControlCommand{Command::Reset}), kDoneExit);
  for (const char* other : {"quality=fast", "solver.name=direct_rod", "hair.stiffness=2"}) {
    EXPECT_EQ(change(other), kDoneExit) << other;
    const uint64_t decoded = viewer->decoded_frames();
    EXPECT_TRUE(pump_until({viewer.get()}, [&] { return viewer->decoded_frames() > decoded + 5; }));
    EXPECT_TRUE(pump_until({viewer.get()}, [&] { return has_lengths(*viewer, usual_m, 0.5); })) << other;
  }
  // Who joins now gets the same.
  auto later = open(client_config());
  ASSERT_TRUE(later);
  ASSERT_TRUE(pump_until({later.get()}, [&] { return later->has_picture(); }));
  EXPECT_TRUE(has_lengths(*later, usual_m, 0.5));
  EXPECT_EQ(later->replay().stats().rejected_frames, 0u);
}

// Whoever sees pictures goes on seeing them, and gets the shape with a change to strands.
TEST_F(HairShape, PicturesGoOnAndStrandsBehindThemHaveTheOtherShape) {
  if (!start(config())) return;
  auto viewer = open(client_config(StreamMode::Frames));
  auto strands = open(client_config());
  ASSERT_TRUE(viewer && strands);
  const std::vector<ViewerSession*> both = {viewer.get(), strands.get()};
  ASSERT_TRUE(pump_until(both, [&] { return viewer->has_picture() && strands->has_picture(); }));
  const std::vector<double> usual_m = lengths_m(*strands);
  EXPECT_EQ(change("hair.curl=0"), kDoneExit);
  EXPECT_EQ(change("hair.length=0.4"), kDoneExit);
  const uint64_t images = viewer->image_count();
  EXPECT_TRUE(pump_until(both, [&] { return viewer->image_count() > images + 3; }));
  viewer->request_mode(StreamMode::Strands);
  ASSERT_TRUE(pump_until(both, [&] { return viewer->mode() == StreamMode::Strands; }));
  EXPECT_TRUE(pump_until(both, [&] { return has_lengths(*viewer, usual_m, 0.4); }));
  EXPECT_EQ(viewer->replay().stats().rejected_frames, 0u);
}

TEST_F(HairShape, StaysWhileARecordingIsWritten) {
  TemporaryFolder folder;
  ServerConfig recorded = config();
  recorded.record = RecordConfig{folder.path() / "run.mcap", IfPresent::Refuse};
  if (!start(recorded)) return;
  EXPECT_EQ(change("hair.length=0.5"), kRefusedExit);
  EXPECT_EQ(change("hair.wind=0.5"), kDoneExit) << "what does not change the shape is recorded";
}

TEST_F(HairShape, ViewersOfARelayJoinAnewAndSeeIt) {
  if (!start(config())) return;
  RelayConfig relay_config;
  relay_config.net.port = 0;
  relay_config.upstream.address = {"127.0.0.1", server_->port()};
  auto relay = Relay::start(relay_config);
  ASSERT_TRUE(relay) << relay.error().to_string();
  ASSERT_TRUE(eventually([&] { return (*relay)->readiness().ok(); }));
  auto viewer = LiveConnection::begin(client_config(StreamMode::Strands, Role::Viewer, (*relay)->port()));
  const auto pump_until = [&](const auto& condition) {
    return eventually([&] {
      (void)viewer->pump(milliseconds(5));
      return viewer->has_session() && viewer->session().has_picture() && condition();
    });
  };
  ASSERT_TRUE(pump_until([] { return true; }));
  const std::vector<double> usual_m = lengths_m(viewer->session());
  EXPECT_EQ(change("hair.length=0.5"), kDoneExit);
  EXPECT_TRUE(pump_until([&] { return has_lengths(viewer->session(), usual_m, 0.5); }));
  (*relay)->stop();
}

}  // namespace
}  // namespace strandcast::hair_shape_test
