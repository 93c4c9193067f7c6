// What the clients' command lines make of addresses, roles and token files.
#include <gmock/gmock.h>

#include <array>
#include <fstream>

#include "client/app/view_options.h"
#include "common/client/client_token.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::client_options_test {
namespace {

using testing::HasSubstr;

ViewOptions read(std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), "strandcast-view");
  const auto line = read_view_command_line(static_cast<int>(arguments.size()), arguments.data());
  EXPECT_TRUE(line.options.has_value());
  if (!line.options) return {};
  return *line.options;
}

TEST(ViewOptions, AskForNoMoreThanTheyNeed) {
  EXPECT_EQ(client_config(read({})).hello.role, Role::Controller);
  EXPECT_EQ(client_config(read({"--view-only"})).hello.role, Role::Viewer);
  EXPECT_EQ(client_config(read({"--headless"})).hello.role, Role::Viewer);
}

TEST(ViewOptions, ACodecIsInsistedOnByItsName) {
  EXPECT_EQ(client_config(read({})).hello.codec_wish, "");
  EXPECT_EQ(client_config(read({"--codec", "auto"})).hello.codec_wish, "");
  EXPECT_EQ(client_config(read({"--codec", "tangent"})).hello.codec_wish, "tangent");
  const char* unknown[] = {"strandcast-view", "--codec", "morse"};
  EXPECT_FALSE(read_view_command_line(3, unknown).options) << "what this build cannot decode is no use";
  const ClientConfig config = client_config(read({}));
  EXPECT_GE(config.hello.step_ns, 0.0);
  EXPECT_LE(config.hello.step_ns, kMaxStepNs);
}

TEST(ViewOptions, EncryptWhenTheAddressOrAnOptionSaysSo) {
  EXPECT_FALSE(client_config(read({})).address.is_tls);
  EXPECT_FALSE(client_config(read({"--connect", "ws://localhost:1"})).address.is_tls);
  EXPECT_TRUE(client_config(read({"--connect", "wss://localhost:1"})).address.is_tls);
  EXPECT_TRUE(client_config(read({"--tls"})).address.is_tls);
  const ClientConfig config = client_config(read({"--tls-ca", "ca.pem"}));
  EXPECT_TRUE(config.address.is_tls);
  EXPECT_EQ(config.tls_authorities, "ca.pem");
}

TEST(ViewOptions, AFolderThatIsNotThereIsNamedBeforeTheRun) {
  for (const char* option : {"--screenshot", "--clip", "--report", "--trace"}) {
    const std::array<const char*, 4> arguments = {"strandcast-view", "--headless", option,
                                                  "/no/such/folder/file"};
    testing::internal::CaptureStderr();
    const auto line = read_view_command_line(static_cast<int>(arguments.size()), arguments.data());
    EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("there is no folder '/no/such/folder'"));
    EXPECT_FALSE(line.options.has_value());
    EXPECT_EQ(line.exit_code, 2);
  }
  EXPECT_EQ(read({"--headless", "--report", "here.txt"}).report, "here.txt");
}

/// What it says to a command line that does not fit together.
std::string refusal_of(std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), "strandcast-view");
  testing::internal::CaptureStderr();
  const auto line = read_view_command_line(static_cast<int>(arguments.size()), arguments.data());
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_FALSE(line.options.has_value());
  EXPECT_EQ(line.exit_code, 2);
  return said;
}

TEST(ViewOptions, APartOfARecordingIsExported) {
  const ViewOptions part = read({"run.mcap", "--export", "out.webm", "--from", "1.5", "--to", "3"});
  EXPECT_EQ(part.film_from_s, 1.5);
  EXPECT_EQ(part.film_to_s, 3.0);
  EXPECT_EQ(read({"run.mcap", "--export", "out.webm"}).film_to_s, std::nullopt);
  EXPECT_THAT(refusal_of({"run.mcap", "--export", "out.webm", "--from", "3", "--to", "2"}),
              HasSubstr("--to 2 is before --from 3"));
  EXPECT_THAT(refusal_of({"run.mcap", "--export", "out.webm", "--to", "2", "--seconds", "2"}),
              HasSubstr("give one of them"));
  EXPECT_THAT(refusal_of({"run.mcap", "--from", "2"}), HasSubstr("which part of a recording --export draws"));
  EXPECT_THAT(refusal_of({"run.mcap", "--trace", "t.csv"}), HasSubstr("a recording has none"));
}

TEST(ViewOptions, AViewIsKeptFromOthersWhereThatIsAskedFor) {
  EXPECT_FALSE(client_config(read({})).hello.keeps_camera);
  EXPECT_TRUE(client_config(read({"--own-camera"})).hello.keeps_camera);
}

class ClientTokenFile : public testing::Test {
 protected:
  std::string token_of(const std::string& text, Role role) {
    std::ofstream(path_) << text;
    const auto token = load_token(path_, role);
    return token ? *token : token.error().to_string();
  }
  TemporaryFolder folder_;
  const std::filesystem::path path_ = folder_.path() / "tokens";
};

TEST_F(ClientTokenFile, GivesTheLeastThatServes) {
  const std::string all = "# made by the server\nviewer v1\ncontroller c1\nsource s1\nadmin a1\n";
  EXPECT_EQ(token_of(all, Role::Viewer), "v1");
  EXPECT_EQ(token_of(all, Role::Controller), "c1");
  EXPECT_EQ(token_of(all, Role::Source), "s1");
  EXPECT_EQ(token_of(all, Role::Admin), "a1");
  EXPECT_EQ(token_of("controller c1\n", Role::Viewer), "c1");
  EXPECT_EQ(token_of("admin a1\n", Role::Source), "a1");
  for (const Role role : {Role::Viewer, Role::Admin}) EXPECT_EQ(token_of("\nplain\n", role), "plain");
}

TEST_F(ClientTokenFile, SaysWhatIsMissing) {
  EXPECT_THAT(token_of("viewer v1\n", Role::Controller), HasSubstr("--view-only"));
  EXPECT_THAT(token_of("source s1\n", Role::Viewer), HasSubstr("no token for a viewer"));
  EXPECT_THAT(token_of("# nothing\n", Role::Viewer), HasSubstr("no token"));
  EXPECT_THAT(token_of("source s1\n", Role::Viewer), testing::Not(HasSubstr("s1")));
}

}  // namespace
}  // namespace strandcast::client_options_test
