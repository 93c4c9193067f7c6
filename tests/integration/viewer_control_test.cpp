// What others do to a viewer: its view is moved, its token is taken back; and when its frames were where.
#include <gmock/gmock.h>

#include <fstream>
#include <map>
#include <sstream>

#include "client/app/camera_command.h"
#include "client/app/live_connection.h"
#include "tests/support/server_fixture.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::viewer_control_test {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

class ViewerControl : public test::ServerFixture {
 protected:
  /// What a controller is told.
  Notice ask(const ClientMessage& message) {
    ClientConfig config = client_config(StreamMode::Strands, Role::Controller);
    config.hello.gets_no_stream = true;
    auto controller = ViewerClient::connect(config);
    EXPECT_TRUE(controller);
    if (!controller) return {};
    EXPECT_TRUE((*controller)->send(message));
    Notice answer{true, "no answer"};
    EXPECT_TRUE(eventually([&] {
      for (const ClientEvent& event : (*controller)->wait(milliseconds(5)))
        if (const auto* notice = std::get_if<Notice>(&event)) return answer = *notice, true;
      return false;
    }));
    return answer;
  }
};

TEST_F(ViewerControl, WhoControlsMovesTheViewOfOneOrOfAllWhoLetIt) {
  if (!start(test::small_scene())) return;
  EXPECT_EQ(ask(CameraCommand{0, {}}).text, "Nobody views this server.");
  auto one = open(client_config());
  auto other = open(client_config());
  ClientConfig own = client_config();
  own.hello.keeps_camera = true;
  auto keeper = open(own);
  ASSERT_TRUE(one && other && keeper);
  const std::vector<ViewerSession*> all = {one.get(), other.get(), keeper.get()};
  ASSERT_TRUE(pump_until(all, [&] { return one->has_picture(); }));

  const CameraDesc camera{{0.5f, 0.25f, -1.0f}, {0.0f, 0.125f, 0.0f}, 0.5f};
  const Notice told = ask(CameraCommand{0, camera});
  EXPECT_FALSE(told.is_error);
  EXPECT_EQ(told.text, "2 viewers look from there. 1 viewer was started with --own-camera.");
  ASSERT_TRUE(pump_until(all, [&] { return one->camera_moves() == 1 && other->camera_moves() == 1; }));
  EXPECT_EQ(one->camera(), camera);
  EXPECT_EQ(keeper->camera_moves(), 0u);
  EXPECT_EQ(keeper->camera(), keeper->look().camera);

  // Sessions count from 1 in the order in which they connect: one of those that asked was the first.
  const Notice missing = ask(CameraCommand{1'000, camera});
  EXPECT_TRUE(missing.is_error);
  EXPECT_THAT(missing.text, HasSubstr("No session 1000 views this server; those that do: 2, 3, 4."));
  CameraDesc closer = camera;
  closer.fov_y_rad = 0.25f;
  EXPECT_EQ(ask(CameraCommand{3, closer}).text, "1 viewer looks from there.");
  ASSERT_TRUE(pump_until(all, [&] { return other->camera_moves() == 2; }));
  EXPECT_EQ(other->camera(), closer);
  EXPECT_EQ(one->camera(), camera);
  const Notice kept = ask(CameraCommand{4, camera});
  EXPECT_TRUE(kept.is_error);
  EXPECT_EQ(kept.text, "0 viewers look from there. 1 viewer was started with --own-camera.");
}

// The server draws for who does not draw: its pictures follow without the viewer's doing.
TEST_F(ViewerControl, ThePicturesOfAViewerAreDrawnFromWhereItWasMovedTo) {
  if (!start(test::small_scene())) return;
  ClientConfig config = client_config(StreamMode::Frames);
  config.hello.frame_width = 96;
  config.hello.frame_height = 72;
  auto viewer = open(config);
  ASSERT_NE(viewer, nullptr);
  ASSERT_TRUE(pump_until({viewer.get()}, [&] { return viewer->has_picture(); }));
  const std::shared_ptr<const Image> before = viewer->shared_image();
  EXPECT_FALSE(ask(CameraCommand{0, {{0.0f, 0.0f, 40.0f}, {0.0f, 0.0f, 0.0f}, 0.5f}}).is_error);
  // Skin and hair are warmer than the background; from so far away they are a few pixels.
  const auto head_share = [](const Image& image) {
    size_t warm = 0;
    for (size_t i = 0; i < image.rgba.size(); i += 4)
      warm += int{image.rgba[i]} > int{image.rgba[i + 2]} + 16 ? 1u : 0u;
    return static_cast<double>(warm) / static_cast<double>(image.rgba.size() / 4);
  };
  EXPECT_GT(head_share(*before), 0.05);
  EXPECT_TRUE(pump_until({viewer.get()}, [&] { return head_share(*viewer->image()) < 0.01; }));
}

TEST(CameraOptions, SayAViewAsAPersonDoes) {
  const CameraDesc scene{{0.0f, 0.3f, 0.4f}, {0.0f, 0.1f, 0.0f}, 0.7f};
  CameraOptions options;
  EXPECT_THAT(camera_of(options, scene).error().to_string(), HasSubstr("say where from"));
  options.view = "scene";
  EXPECT_EQ(*camera_of(options, scene), scene);
  options.view = "left";
  CameraDesc left = *camera_of(options, scene);
  EXPECT_NEAR(left.offset_m.x, 0.5, 1e-6) << "as far away as the scene's";
  EXPECT_NEAR(left.offset_m.y, 0.0, 1e-6);
  EXPECT_EQ(left.target_m, scene.target_m);
  options.pitch_deg = 90.0 - 53.13010235;
  options.distance_m = 5.0;
  options.target_m = {1.0, 2.0, 3.0};
  options.fov_deg = 90.0;
  left = *camera_of(options, scene);
  EXPECT_NEAR(left.offset_m.x, 4.0, 1e-5);
  EXPECT_NEAR(left.offset_m.y, 3.0, 1e-5);
  EXPECT_EQ(left.target_m, glm::vec3(1.0f, 2.0f, 3.0f));
  EXPECT_NEAR(left.fov_y_rad, 1.5707963, 1e-6);
  CameraOptions wide;
  wide.fov_deg = 90.0;
  EXPECT_EQ(camera_of(wide, scene)->offset_m, scene.offset_m) << "what is not said stays, bit for bit";
}

// It does not try again with a token that is gone, and says why.
TEST_F(ViewerControl, AViewerWhoseTokenIsTakenBackSaysSoAndStops) {
  ServerConfig config;
  config.scene = test::small_scene();
  config.net.tokens = {{"viewer-token-0000", Grant::Viewer}, {"admin-token-1111", Grant::Admin}};
  const std::vector<AccessToken> left = {config.net.tokens[1]};
  if (!start(std::move(config))) return;
  ClientConfig client = client_config();
  client.hello.token = "viewer-token-0000";
  auto live = LiveConnection::open(client);
  ASSERT_TRUE(live) << live.error().to_string();
  ASSERT_TRUE(eventually([&] { return (*live)->pump(milliseconds(5)), (*live)->session().has_picture(); }));
  ASSERT_TRUE(server_->set_tokens(left));
  ASSERT_TRUE(eventually([&] { return (*live)->pump(milliseconds(5)), (*live)->final_error().has_value(); }));
  EXPECT_FALSE((*live)->is_connected());
  EXPECT_THAT((*live)->trouble(), HasSubstr("This session's token was taken back: ask for a new one."));
  EXPECT_THAT((*live)->help(), HasSubstr("--token-file"));
  EXPECT_EQ((*live)->doing(), "") << "nothing is tried";
}

/// Values of each line by the names of the columns, by tick.
std::map<uint64_t, std::map<std::string, std::string>> rows_of(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::string line, cell;
  std::vector<std::string> names;
  std::map<uint64_t, std::map<std::string, std::string>> rows;
  while (std::getline(file, line)) {
    std::istringstream cells(line);
    std::vector<std::string> values;
    while (std::getline(cells, cell, ',')) values.push_back(cell);
    if (names.empty()) {
      names = values;
      continue;
    }
    std::map<std::string, std::string> row;
    for (size_t i = 0; i < names.size(); ++i) row[names[i]] = values.at(i);
    rows[std::stoull(row.at("tick"))] = row;
  }
  return rows;
}

TEST_F(ViewerControl, TracesOfServerAndViewerAreJoinedByTick) {
  TemporaryFolder folder;
  ServerConfig config;
  config.scene = test::small_scene();
  config.trace_path = folder.path() / "server.csv";
  if (!start(std::move(config))) return;
  auto source = ViewerClient::connect(client_config(StreamMode::Strands, Role::Source));
  ASSERT_TRUE(source);
  auto viewer = open(client_config());
  ASSERT_NE(viewer, nullptr);
  const auto trace = std::make_shared<FrameTrace>();
  ASSERT_TRUE(trace->open(folder.path() / "viewer.csv"));
  trace->want_states(true);
  viewer->set_trace(trace);
  const auto is_whole = [](const FrameTimes& frame) {
    return frame.motion_ns != 0 && frame.encoded_ns != 0 && frame.received_ns != 0;
  };
  uint64_t shown_tick = 0;
  ASSERT_TRUE(pump_until({viewer.get()}, [&] {
    EXPECT_TRUE((*source)->send(MotionSamples{{{now_ns(), Pose()}}}));
    if (const auto newest = viewer->replay().newest(); newest != nullptr && newest->tick != shown_tick) {
      shown_tick = newest->tick;
      trace->note_presented(StreamMode::Strands, newest->sim_time_ns,
                            viewer->client().clock().to_server_ns(now_ns()));
    }
    const auto frames = trace->frames();
    return std::count_if(frames.begin(), frames.end(), is_whole) >= 5;
  }));
  server_->stop();
  server_.reset();  // writes the rest
  ASSERT_TRUE(trace->close());

  const auto ours = rows_of(folder.path() / "viewer.csv"), theirs = rows_of(folder.path() / "server.csv");
  size_t joined = 0;
  for (const auto& [tick, row] : ours) {
    const auto found = theirs.find(tick);
    ASSERT_NE(found, theirs.end()) << tick;
    const auto& other = found->second;
    EXPECT_EQ(row.at("sim_time_ns"), other.at("sim_time_ns"));
    EXPECT_EQ(row.at("motion_ns"), other.at("motion_ns"));
    if (row.at("published_ns") == "0" || row.at("received_ns") == "0") continue;
    for (const char* column : {"source_ns", "published_ns", "encoded_ns"})
      EXPECT_EQ(row.at(column), other.at(column)) << column << " of " << tick;
    const auto ns = [&row](const char* column) { return std::stoll(row.at(column)); };
    if (ns("motion_ns") == 0 || ns("encoded_ns") == 0) continue;
    ++joined;
    EXPECT_GT(ns("source_ns"), 0);
    EXPECT_LE(ns("source_ns"), ns("motion_ns"));
    EXPECT_LE(ns("motion_ns"), ns("published_ns"));
    EXPECT_LE(ns("published_ns"), ns("sent_ns"));
    EXPECT_LE(ns("sent_ns"), ns("received_ns") + ns("clock_error_ns"));
    EXPECT_LE(ns("received_ns"), ns("decoded_ns"));
    // By two estimates of the clock.
    if (ns("presented_ns") != 0) {
      EXPECT_LE(ns("decoded_ns"), ns("presented_ns") + 2 * ns("clock_error_ns"));
    }
  }
  EXPECT_GE(joined, 5u);
}

}  // namespace
}  // namespace strandcast::viewer_control_test
