// strandcast-view --diagnose as a person starts it, against servers that cannot be used: one sentence each,
// with the way out. One that can be used: end_to_end_test.cpp.
#include <gmock/gmock.h>

#include "common/base/file.h"
#include "tests/support/child_process.h"
#include "tests/support/fake_server.h"
#include "tests/support/server_net_fixture.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_certificate.h"

namespace strandcast::diagnose_test {
namespace {

using test::ChildProcess;
using test::FakePeer;
using test::FakeServer;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kToken = "0123456789abcdef";

class Diagnose : public test::ServerNet {
 protected:
  /// What it prints; `exit_code` is what it leaves with. No such GL device, so that none is looked for.
  std::string diagnose(const std::string& address, int exit_code, std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"--diagnose", address, "--device", "99"});
    const auto output = folder_.path() / "output";
    ChildProcess program(STRANDCAST_VIEW_PROGRAM, std::move(more), output);
    EXPECT_EQ(program.wait(), exit_code);
    const auto text = load_text(output, 1u << 16);
    return text ? *text : text.error().to_string();
  }
  std::string here(const std::string& scheme = {}) const {
    return scheme + "127.0.0.1:" + std::to_string(server_->port());
  }
  /// As somebody from another machine meets it.
  void start_encrypted() {
    NetConfig config;
    config.tls = test::make_certificate(folder_.path(), "server", {});
    config.loopback_trust = LoopbackTrust::LikeAllOthers;
    config.tokens = {{kToken, Grant::AllButAdmin}};
    start(config);
  }
  /// The line about this subject.
  static std::string line_of(const std::string& text, const std::string& subject) {
    const size_t found = text.find(" " + subject + " ");
    if (found == std::string::npos) return {};
    const size_t begin = text.rfind('\n', found) + 1;  // npos + 1 is the beginning
    return text.substr(begin, text.find('\n', found) - begin);
  }

  TemporaryFolder folder_;
};

TEST_F(Diagnose, AServerThatIsDown) {
  start();
  const std::string address = here();
  server_->stop();
  server_.reset();  // nobody listens on its port any more
  const std::string text = diagnose(address, 1);
  EXPECT_THAT(text, HasSubstr("a session would not work\n"));
  const std::string line = line_of(text, "server");
  EXPECT_THAT(line, HasSubstr("missing"));
  EXPECT_THAT(line, HasSubstr("cannot connect"));
  EXPECT_THAT(line, HasSubstr("start strandcast-server there"));
  EXPECT_THAT(line_of(text, "drawing"), HasSubstr("the server's pictures are shown instead"));
  EXPECT_THAT(line_of(text, "decoders"), HasSubstr("tangent"));
}

TEST_F(Diagnose, StrandsWithoutWhatDrawsThemAreMissingIt) {
  const std::string line = line_of(diagnose("127.0.0.1:1", 1, {"--mode", "strands"}), "drawing");
  EXPECT_THAT(line, HasSubstr("missing"));
  EXPECT_THAT(line, HasSubstr("--mode auto or frames"));
}

TEST_F(Diagnose, APortOfSomethingElse) {
  const FakeServer web([](FakePeer& peer) { peer.answer_http(404, "no such page"); });
  const std::string line = line_of(diagnose("127.0.0.1:" + std::to_string(web.port()), 1), "server");
  EXPECT_THAT(line, HasSubstr("404"));
  EXPECT_THAT(line, HasSubstr("something else than strandcast-server answers there"));
}

TEST_F(Diagnose, ATokenThatIsWrongOrForLess) {
  NetConfig config;
  config.tokens = {{kToken, Grant::Viewer}};
  start(config);
  std::string line = line_of(diagnose(here(), 1, {"--token", "another one, surely"}), "role");
  EXPECT_THAT(line, HasSubstr("The token is wrong or missing."));
  EXPECT_THAT(line, HasSubstr("--token-file"));
  EXPECT_THAT(line, Not(HasSubstr("another one"))) << "what was typed is a secret";
  line = line_of(diagnose(here(), 1, {"--token", kToken, "--mode", "frames"}), "role");
  EXPECT_THAT(line, HasSubstr("good for viewer, not for a controller"));
  EXPECT_THAT(line, HasSubstr("--view-only works with this token"));
}

TEST_F(Diagnose, TlsOnOneSideOnly) {
  start();
  EXPECT_THAT(line_of(diagnose(here("wss://"), 1), "TLS"), HasSubstr("leave out wss://"));
}

TEST_F(Diagnose, TlsOnTheOtherSideOnly) {
  start_encrypted();
  EXPECT_THAT(line_of(diagnose(here(), 1), "server"),
              HasSubstr("the server speaks TLS: use wss://127.0.0.1:" + std::to_string(server_->port())));
  EXPECT_THAT(line_of(diagnose(here("wss://"), 1), "TLS"), HasSubstr("--tls-ca FILE names its authority"));
}

TEST_F(Diagnose, AServerThatSendsNothing) {
  start();
  const std::string text = diagnose(here(), 1, {"--mode", "frames"});
  EXPECT_THAT(line_of(text, "server"), HasSubstr("scene 'fake'"));
  EXPECT_THAT(line_of(text, "role"), HasSubstr("controller, not encrypted"));
  EXPECT_THAT(line_of(text, "stream"), HasSubstr("missing"));
}

TEST_F(Diagnose, AnAddressThatIsNoneIsAnErrorOfUse) {
  EXPECT_THAT(diagnose("127.0.0.1:99999", 2), HasSubstr("is not an address"));
}

}  // namespace
}  // namespace strandcast::diagnose_test
