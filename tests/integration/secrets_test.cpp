// No token appears in what the programs write, at any level of detail.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <sstream>

#include "common/record/chunk_list.h"
#include "tests/support/child_process.h"
#include "tests/support/lacks_gl.h"
#include "tests/support/raw_client.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::secrets_test {
namespace {

using test::ChildProcess;
using testing::HasSubstr;
using testing::Not;

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

class Secrets : public testing::Test {
 protected:
  /// Null after a skip.
  std::unique_ptr<ChildProcess> serve() {
    const std::string port_path = (folder_.path() / "port").string();
    auto server = std::make_unique<ChildProcess>(
        STRANDCAST_SERVER_PROGRAM,
        std::vector<std::string>{"--port", "0", "--port-file", port_path, "--token-file", token_path_,
                                 "--set", "groom.procedural.strand_count=50", "--log-level", "debug",
                                 "--record", recording_path_, "--record-replace"},
        folder_.path() / "server.txt");
    EXPECT_TRUE(eventually([&] { return server->has_ended() || std::filesystem::exists(port_path); }));
    if (server->has_ended()) return nullptr;
    connect_ = "127.0.0.1:" + text_of(port_path);
    connect_.pop_back();
    return server;
  }
  std::string server_output() const { return text_of(folder_.path() / "server.txt"); }
  /// Its exit code; what it wrote is added to client_output_.
  int ctl(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--connect", connect_, "--log", "debug"});
    ChildProcess program(STRANDCAST_CTL_PROGRAM, arguments, folder_.path() / "ctl.txt");
    const int code = program.wait();
    client_output_ += text_of(folder_.path() / "ctl.txt");
    return code;
  }

  /// All chunks of the recording, decompressed.
  std::string recorded_text() const {
    const auto source = open_byte_source(recording_path_);
    const auto list = source ? list_chunks(**source) : Result<ChunkList>(source.error());
    EXPECT_TRUE(list);
    std::string text;
    if (!list) return text;
    for (const ChunkPlace& place : list->chunks) {
      const auto chunk = load_chunk(**source, place);
      EXPECT_TRUE(chunk);
      if (chunk) text.append(reinterpret_cast<const char*>(chunk->records.data()), chunk->records.size());
    }
    return text;
  }

  TemporaryFolder folder_;
  const std::string token_path_ = (folder_.path() / "tokens").string();
  const std::string recording_path_ = (folder_.path() / "run.mcap").string();
  std::string connect_;
  std::string client_output_;
};

TEST_F(Secrets, AreNeverWritten) {
  const std::vector<std::string> good = {"11112222333344445555666677778888",
                                         "99990000aaaabbbbccccddddeeeeffff"};
  const std::string bad = "13572468135724681357246813572468";
  std::ofstream(token_path_) << "viewer " << good[0] << "\nadmin " << good[1] << "\n";
  ASSERT_EQ(chmod(token_path_.c_str(), 0600), 0);
  const auto server = serve();
  if (server == nullptr && test::lacks_gl(server_output()))
    GTEST_SKIP() << "needs OpenGL 4.5: " << server_output();
  ASSERT_NE(server, nullptr) << server_output();

  EXPECT_EQ(ctl({"--token-file", token_path_, "sessions"}), 0) << client_output_;
  EXPECT_THAT(client_output_, HasSubstr("admin"));
  EXPECT_EQ(ctl({"--token", good[0], "pause"}), 2) << "a viewer may not";
  EXPECT_EQ(ctl({"--token", bad, "pause"}), 2);
  EXPECT_EQ(ctl({"--token", good[0], "monitor", "--seconds", "0.2"}), 0) << client_output_;
  EXPECT_EQ(ctl({"--token", good[1], "kick", "12345"}), 1);
  EXPECT_EQ(ctl({"--token", good[1], "set", "substeps=2"}), 0) << client_output_;
  // Where people and programs put one by mistake.
  const auto port = static_cast<uint16_t>(std::stoi(connect_.substr(connect_.find(':') + 1)));
  test::http_get(port, "/v1/" + good[0]);
  test::http_get(port, "/healthz?token=" + good[1]);
  EXPECT_TRUE(eventually([&] { return server_output().find("/v1/(token)") != std::string::npos; }))
      << server_output();
  EXPECT_EQ(ctl({"--token-file", token_path_, "shutdown"}), 0) << client_output_;
  EXPECT_EQ(server->wait(), 0) << server_output();

  const std::string recorded = recorded_text();
  EXPECT_THAT(recorded, HasSubstr("substeps=2")) << "what the admin changed";
  EXPECT_THAT(server_output(), HasSubstr("joined: admin"));
  EXPECT_THAT(server_output(), HasSubstr("token is wrong"));
  for (const std::string& token : {good[0], good[1], bad})
    for (const std::string& part : {token.substr(0, token.size() / 2), token.substr(token.size() / 2)})
      for (const std::string& text : {server_output(), client_output_, recorded})
        EXPECT_THAT(text, Not(HasSubstr(part)));
}

TEST_F(Secrets, NewTokensAreShownOnce) {
  auto server = serve();
  if (server == nullptr && test::lacks_gl(server_output()))
    GTEST_SKIP() << "needs OpenGL 4.5: " << server_output();
  ASSERT_NE(server, nullptr) << server_output();
  const std::string tokens = text_of(token_path_);
  EXPECT_EQ(std::count(tokens.begin(), tokens.end(), '\n'), 4);
  const std::string first = server_output();
  const size_t shown = first.find(tokens);
  ASSERT_NE(shown, std::string::npos) << first;
  EXPECT_EQ(first.find(tokens.substr(7, 32), shown + tokens.size()), std::string::npos);
  server->send_signal(SIGTERM);
  EXPECT_EQ(server->wait(), 0);
  std::filesystem::remove(folder_.path() / "port");
  server = serve();
  ASSERT_NE(server, nullptr) << server_output();
  EXPECT_EQ(text_of(token_path_), tokens);
  EXPECT_THAT(server_output(), Not(HasSubstr(tokens.substr(7, 32))));
  server->send_signal(SIGTERM);
  EXPECT_EQ(server->wait(), 0);
}

}  // namespace
}  // namespace strandcast::secrets_test
