// Programs that are killed, stopped, starved of descriptors or told to end, with viewers attached.
#include <netinet/in.h>
#include <sys/socket.h>

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "client/app/live_connection.h"
#include "client/net/http_get.h"
#include "common/record/recording_reader.h"
#include "tests/support/child_process.h"
#include "tests/support/eventually.h"
#include "tests/support/lacks_gl.h"
#include "tests/support/temporary_folder.h"
#include "tests/tools/load/load_viewers.h"

namespace strandcast::process_faults_test {
namespace {

using load::LoadViewers;
using test::ChildProcess;

class ProcessFaults : public testing::Test {
 protected:
  /// A server with a small scene; null after a skip.
  std::unique_ptr<ChildProcess> serve(uint16_t port = 0, const std::vector<std::string>& more = {}) {
    std::filesystem::remove(port_path_);
    std::vector<std::string> arguments = {"--port",      std::to_string(port),
                                          "--port-file", port_path_.string(),
                                          "--set",       "groom.procedural.strand_count=50",
                                          "--log-level", "info"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    auto server =
        std::make_unique<ChildProcess>(STRANDCAST_SERVER_PROGRAM, arguments, folder_.path() / "server.txt");
    EXPECT_TRUE(eventually([&] { return server->has_ended() || std::filesystem::exists(port_path_); }));
    if (server->has_ended()) return nullptr;
    std::ifstream(port_path_) >> port_;
    return server;
  }
  std::string text_of(const char* file_name) const {
    std::ifstream file(folder_.path() / file_name);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  }
  std::string output() const { return text_of("server.txt"); }
  static bool is_listening(uint16_t port) {
    const int handle = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int connected = connect(handle, reinterpret_cast<const sockaddr*>(&address), sizeof address);
    close(handle);
    return connected == 0;
  }
  template <class Condition>
  static bool run_until(LoadViewers& viewers, Condition condition) {
    return eventually([&] {
      viewers.run_for(10);
      return condition();
    });
  }

  TemporaryFolder folder_;
  const std::filesystem::path port_path_ = folder_.path() / "port";
  uint16_t port_ = 0;
};

TEST_F(ProcessFaults, TerminationSaysGoodbyeToSixtyFourViewers) {
  const auto server = serve();
  if (server == nullptr && test::lacks_gl(output())) GTEST_SKIP() << "needs OpenGL 4.5: " << output();
  ASSERT_NE(server, nullptr) << output();
  constexpr size_t kViewers = 64;
  LoadViewers viewers({"127.0.0.1", port_, {}});
  for (size_t i = 0; i < kViewers; ++i) ASSERT_TRUE(viewers.join({}).ok());
  ASSERT_TRUE(run_until(viewers, [&] { return viewers.watching_count() == kViewers; }));
  server->send_signal(SIGTERM);
  EXPECT_TRUE(run_until(viewers, [&] { return viewers.open_count() == 0; }));
  EXPECT_EQ(viewers.measures().close_codes, (std::map<uint16_t, uint64_t>{{1001, kViewers}}));
  EXPECT_THAT(viewers.measures().last_goodbye, testing::HasSubstr("stopping"));
  EXPECT_EQ(server->wait(), 0) << output();
}

TEST_F(ProcessFaults, AFullDiskEndsTheRecordingAndIsSaidAtTheEnd) {
  const std::filesystem::path recording = folder_.path() / "run.mcap";
  const auto server = serve(0, {"--record", recording.string()});
  if (server == nullptr && test::lacks_gl(output())) GTEST_SKIP() << "needs OpenGL 4.5: " << output();
  ASSERT_NE(server, nullptr) << output();
  // No file of the server's may grow beyond what is there now and a little more.
  ASSERT_TRUE(eventually([&] { return RecordingReader::open(recording).ok(); }));
  const rlimit limit{std::filesystem::file_size(recording) + 20'000,
                     std::filesystem::file_size(recording) + 20'000};
  ASSERT_EQ(prlimit(server->id(), RLIMIT_FSIZE, &limit, nullptr), 0);
  EXPECT_TRUE(eventually([&] { return output().find("the recording ends here") != std::string::npos; }))
      << output();
  LoadViewers viewers({"127.0.0.1", port_, {}});
  ASSERT_TRUE(viewers.join({}).ok());
  EXPECT_TRUE(run_until(viewers, [&] { return viewers.watching_count() == 1; })) << "it does not go on";
  server->send_signal(SIGTERM);
  EXPECT_EQ(server->wait(), 1) << output();
  const std::string said = output();
  EXPECT_THAT(said, testing::HasSubstr("the recording is not whole"));
  EXPECT_EQ(said.find("the recording ends here"), said.rfind("the recording ends here")) << "said once";
  const auto reader = RecordingReader::open(recording);
  ASSERT_TRUE(reader) << reader.error().to_string();
  EXPECT_EQ((*reader)->info().cut_bytes, 0u) << "what was written is whole";
}

// Whoever may record beside it, or ends it, does not make it whole.
TEST_F(ProcessFaults, AFullDiskIsSaidAtTheEndBesideAFolderForTakesToo) {
  const std::filesystem::path recording = folder_.path() / "run.mcap";
  const auto server = serve(0, {"--record", recording.string(), "--record-dir", folder_.path().string()});
  if (server == nullptr && test::lacks_gl(output())) GTEST_SKIP() << "needs OpenGL 4.5: " << output();
  ASSERT_NE(server, nullptr) << output();
  ASSERT_TRUE(eventually([&] { return RecordingReader::open(recording).ok(); }));
  const rlimit limit{std::filesystem::file_size(recording) + 20'000,
                     std::filesystem::file_size(recording) + 20'000};
  ASSERT_EQ(prlimit(server->id(), RLIMIT_FSIZE, &limit, nullptr), 0);
  LoadViewers viewers({"127.0.0.1", port_, {}});
  ASSERT_TRUE(viewers.join({}).ok());
  ASSERT_TRUE(run_until(viewers, [&] { return output().find("the recording ends: ") != std::string::npos; }))
      << output();
  const auto metrics = http_get({"127.0.0.1", port_, {}}, "/metrics", std::chrono::seconds(10), {});
  ASSERT_TRUE(metrics) << metrics.error().to_string();
  EXPECT_THAT(metrics->body, testing::HasSubstr("\nstrandcast_record_active 0\n"));
  server->send_signal(SIGTERM);
  EXPECT_EQ(server->wait(), 1) << output();
  EXPECT_THAT(output(), testing::HasSubstr("the recording is not whole"));
}

TEST_F(ProcessFaults, AKilledServerIsFoundAgain) {
  auto server = serve();
  if (server == nullptr && test::lacks_gl(output())) GTEST_SKIP() << "needs OpenGL 4.5: " << output();
  ASSERT_NE(server, nullptr) << output();
  ClientConfig config;
  config.address.port = port_;
  auto live = LiveConnection::open(config);
  ASSERT_TRUE(live.ok()) << live.error().to_string();
  const auto pump_until = [&](auto condition) {
    return eventually([&] {
      (*live)->pump(std::chrono::milliseconds(5));
      return condition();
    });
  };
  ASSERT_TRUE(pump_until([&] { return (*live)->session().has_picture(); }));
  const std::string first = (*live)->session().welcome().session_id;
  server->send_signal(SIGKILL);
  EXPECT_EQ(server->wait(), -1);
  ASSERT_TRUE(pump_until([&] { return !(*live)->is_connected(); }));
  EXPECT_FALSE((*live)->trouble().empty());
  EXPECT_NE((*live)->session().replay().newest(), nullptr) << "the last state stays while the server is away";
  server = serve(port_);
  ASSERT_NE(server, nullptr) << output();
  EXPECT_TRUE(pump_until([&] { return (*live)->is_connected() && (*live)->session().has_picture(); }));
  EXPECT_NE((*live)->session().welcome().session_id, first) << "another start of the server";
}

TEST_F(ProcessFaults, WithoutDescriptorsTheServerServesThoseItHas) {
#if defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "the undefined-behaviour sanitizer looks at virtual tables through a pipe, and without "
                  "descriptors for it ends the server";
#endif
  const auto server = serve();
  if (server == nullptr && test::lacks_gl(output())) GTEST_SKIP() << "needs OpenGL 4.5: " << output();
  ASSERT_NE(server, nullptr) << output();
  LoadViewers early({"127.0.0.1", port_, {}});
  ASSERT_TRUE(early.join({}).ok());
  ASSERT_TRUE(run_until(early, [&] { return early.watching_count() == 1; }));
  server->limit_descriptors(28);
  LoadViewers crowd({"127.0.0.1", port_, {}});
  for (int i = 0; i < 40; ++i) ASSERT_TRUE(crowd.join({}).ok());
  EXPECT_TRUE(eventually([&] { return output().find("cannot accept") != std::string::npos; })) << output();
  crowd.run_for(200);
  EXPECT_LT(crowd.watching_count(), 40u);
  const uint64_t frames = early.measures().frames;
  EXPECT_TRUE(run_until(early, [&] { return early.measures().frames > frames + 20; }));
  EXPECT_EQ(early.measures().ended, 0u);
  while (crowd.open_count() > 0) crowd.leave(crowd.oldest(), true);
  LoadViewers late({"127.0.0.1", port_, {}});
  ASSERT_TRUE(late.join({}).ok());
  EXPECT_TRUE(run_until(late, [&] { return late.watching_count() == 1; })) << "there is room again";
  server->send_signal(SIGTERM);
  EXPECT_EQ(server->wait(), 0);
}

TEST_F(ProcessFaults, ASuspendedViewerIsDroppedAndComesBack) {
  const auto server = serve();
  if (server == nullptr && test::lacks_gl(output())) GTEST_SKIP() << "needs OpenGL 4.5: " << output();
  ASSERT_NE(server, nullptr) << output();
  const auto report = folder_.path() / "report.txt";
  ChildProcess viewer(STRANDCAST_VIEW_PROGRAM,
                      {"--connect", "127.0.0.1:" + std::to_string(port_), "--headless", "--seconds", "600",
                       "--report", report.string()},
                      folder_.path() / "viewer.txt");
  const auto count_in_log = [&](const char* what) {
    size_t count = 0;
    const std::string text = output();
    for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
    return count;
  };
  ASSERT_TRUE(eventually([&] { return count_in_log("joined") == 1; }));
  viewer.send_signal(SIGSTOP);
  EXPECT_TRUE(eventually([&] { return count_in_log("dropped") == 1; })) << "a silent viewer is not kept";
  viewer.send_signal(SIGCONT);
  EXPECT_TRUE(eventually([&] { return count_in_log("joined") == 2; })) << "and may come back";
  viewer.send_signal(SIGTERM);
  EXPECT_EQ(viewer.wait(), 0) << "a stop is no failure, and leaves a report";
  EXPECT_TRUE(std::filesystem::exists(report));
}

TEST_F(ProcessFaults, ASignalEndsAViewerThatDrawsItsClip) {
  const auto server = serve();
  if (server == nullptr && test::lacks_gl(output())) GTEST_SKIP() << "needs OpenGL 4.5: " << output();
  ASSERT_NE(server, nullptr) << output();
  const auto clip = folder_.path() / "clip.webp";
  // More pictures than are drawn in the time that eventually() waits, on a processor.
  ChildProcess viewer(
      STRANDCAST_VIEW_PROGRAM,
      {"--connect", "127.0.0.1:" + std::to_string(port_), "--headless", "--mode", "strands", "--seconds", "2",
       "--clip", clip.string(), "--clip-seconds", "30", "--clip-fps", "60", "--clip-size", "1920x1080"},
      folder_.path() / "viewer.txt");
  const auto said = [&] { return text_of("viewer.txt"); };
  ASSERT_TRUE(eventually([&] {
    return viewer.has_ended() || said().find("drawing the clip: picture 1 of ") != std::string::npos;
  }));
  viewer.send_signal(SIGINT);
  EXPECT_TRUE(eventually([&] { return viewer.has_ended(); })) << said();
  EXPECT_FALSE(std::filesystem::exists(clip)) << "a clip is whole or not there";
}

TEST_F(ProcessFaults, ASignalEndsTheFeeder) {
  const auto server = serve();
  if (server == nullptr && test::lacks_gl(output())) GTEST_SKIP() << "needs OpenGL 4.5: " << output();
  ASSERT_NE(server, nullptr) << output();
  ChildProcess feeder(STRANDCAST_CTL_PROGRAM,
                      {"feed", "--connect", "127.0.0.1:" + std::to_string(port_), "--seconds", "600"},
                      folder_.path() / "feeder.txt");
  ASSERT_TRUE(eventually([&] { return text_of("feeder.txt").find("feeding ") != std::string::npos; }));
  feeder.send_signal(SIGINT);
  EXPECT_EQ(feeder.wait(), 0) << text_of("feeder.txt");
  EXPECT_THAT(text_of("feeder.txt"), testing::HasSubstr("motion and"));
}

// A tree with the script of this one and the programs of this build, so that nothing is installed or built.
TEST_F(ProcessFaults, ASignalToTheRunScriptEndsAllThatItStarted) {
  namespace fs = std::filesystem;
  const fs::path tree = folder_.path() / "tree", bin = tree / "build" / "release" / "bin",
                 stubs = tree / "stubs";
  for (const fs::path& folder : {tree / "deploy", bin, stubs}) fs::create_directories(folder);
  fs::copy_file(fs::path(STRANDCAST_SOURCE_DIR) / "deploy" / "run.sh", tree / "deploy" / "run.sh");
  std::ofstream(tree / "deploy" / "install_deps.sh") << "exit 0\n";
  std::ofstream(stubs / "cmake") << "#!/bin/sh\nexit 0\n";
  fs::permissions(stubs / "cmake", fs::perms::owner_all);
  for (const char* program : {STRANDCAST_SERVER_PROGRAM, STRANDCAST_VIEW_PROGRAM, STRANDCAST_CTL_PROGRAM})
    fs::create_symlink(program, bin / fs::path(program).filename());
  setenv("PATH", (stubs.string() + ":" + getenv("PATH")).c_str(), 1);
  ChildProcess script("/bin/bash",
                      {(tree / "deploy" / "run.sh").string(), "--headless", "--seconds", "2", "--set",
                       "groom.procedural.strand_count=50", "--out", (tree / "out").string()},
                      folder_.path() / "script.txt");
  const auto said = [&] { return text_of("script.txt"); };
  const auto has_said = [&](const char* what) { return said().find(what) != std::string::npos; };
  ASSERT_TRUE(eventually([&] { return script.has_ended() || has_said("drawing the clip: picture 1 of "); }))
      << said();
  if (test::lacks_gl(said())) GTEST_SKIP() << "needs OpenGL 4.5: " << said();
  script.send_signal(SIGTERM);
  EXPECT_EQ(script.wait(), 0) << said();
  EXPECT_FALSE(fs::exists(tree / "out" / "hair.webp")) << "nobody waited for the clip";
  const std::string text = said();
  const std::string before = "Server on 127.0.0.1:";
  const size_t at = text.find(before);
  ASSERT_NE(at, std::string::npos) << text;
  const int port = std::stoi(text.substr(at + before.size()));
  EXPECT_FALSE(is_listening(static_cast<uint16_t>(port))) << "the server is gone too";
}

}  // namespace
}  // namespace strandcast::process_faults_test
