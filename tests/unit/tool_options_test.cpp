// Every option of strandcast-chaos and strandcast-load: the field that it sets, and that it sets no other.
#include <CLI/CLI.hpp>

#include "tests/support/option_table.h"
#include "tests/tools/chaos_options.h"
#include "tests/tools/load/load_options.h"

namespace strandcast::test {

inline void tell(FieldTexts& told, const std::string& where, const chaos::LinkPlan& all) {
  OPTION_FIELDS(all, delay_us, jitter_us, loss, bytes_per_s, queue_bytes, freeze_every_us, freeze_us,
                reset_after_bytes, silent_after_bytes, corrupt_per_byte, writes);
}
inline void tell(FieldTexts& told, const std::string& where, const chaos::RelayConfig& all) {
  OPTION_FIELDS(all, listen_host, listen_port, to_host, to_port, up, down, seed);
}
inline void tell(FieldTexts& told, const std::string& where, const load::LoadOptions& all) {
  OPTION_FIELDS(all, connect, token, token_file, is_tls, tls_authorities, viewers, frame_viewers,
                silent_viewers, stalled_viewers, seconds, warm_up_s, churn_ms, server_pid);
}

}  // namespace strandcast::test

namespace strandcast::tool_options_test {
namespace {

using test::Arguments;
using test::OptionRow;
using test::text_of;

/// Options as `declare` reads them; the first ones where a command line is refused.
template <class Options>
Options parse(void (*declare)(CLI::App&, Options&), Arguments arguments) {
  CLI::App app;
  Options options;
  declare(app, options);
  std::reverse(arguments.begin(), arguments.end());
  try {
    app.parse(arguments);
  } catch (const CLI::ParseError& failure) {
    ADD_FAILURE() << failure.what();
  }
  return options;
}

template <class Options>
std::string help_of(void (*declare)(CLI::App&, Options&)) {
  CLI::App app;
  Options options;
  declare(app, options);
  return app.help();
}

/// A fault of both directions.
OptionRow both_ways(const std::string& option, const std::string& value, const std::string& field,
                    const std::string& text) {
  return {option, {value}, {{"up." + field, text}, {"down." + field, text}}};
}

TEST(ToolOptionTable, OfChaos) {
  using chaos::Writes;
  const std::string without = text_of(chaos::LinkPlan().queue_bytes);  // of a direction without faults
  const OptionRow kRows[] = {
      {"--listen", {"127.0.0.2:81"}, {{"listen_host", "127.0.0.2"}, {"listen_port", "81"}}},
      {"--listen", {"127.0.0.1:0"}, {{"listen_port", "0"}}},
      {"--to", {"other:81"}, {{"to_host", "other"}, {"to_port", "81"}}},
      {"--direction", {"up"}, {{"down.delay_us", "0"}, {"down.queue_bytes", without}}, {"--delay-ms", "2"}},
      {"--direction", {"down"}, {{"up.delay_us", "0"}, {"up.queue_bytes", without}}, {"--delay-ms", "2"}},
      both_ways("--delay-ms", "2", "delay_us", "2000"),
      both_ways("--jitter-ms", "2", "jitter_us", "2000"),
      both_ways("--loss", "0.25", "loss", "0.25"),
      both_ways("--rate-mbit", "8", "bytes_per_s", "1000000"),
      both_ways("--queue-kb", "2", "queue_bytes", "2000"),
      both_ways("--freeze-every-ms", "2", "freeze_every_us", "2000"),
      both_ways("--freeze-ms", "2", "freeze_us", "2000"),
      both_ways("--reset-after-bytes", "7", "reset_after_bytes", "7"),
      both_ways("--silent-after-bytes", "7", "silent_after_bytes", "7"),
      both_ways("--corrupt-per-mb", "500000", "corrupt_per_byte", "0.5"),
      both_ways("--writes", "one-byte", "writes", text_of(Writes::OneByte)),
      both_ways("--writes", "split", "writes", text_of(Writes::Split)),
      both_ways("--writes", "merged", "writes", text_of(Writes::Merged)),
      {"--reset-every", {"2"}, {{"reset_every_s", "2"}}},
      {"--seed", {"7"}, {{"seed", "7"}}},
      {"--seconds", {"2"}, {{"seconds", "2"}}}};
  test::expect_changes(std::span(kRows), [](const Arguments& arguments) {
    const chaos::ChaosOptions options = parse(chaos::declare_chaos, arguments);
    const auto config = chaos::relay_config(options);
    std::optional<test::FieldTexts> told;
    if (!config) return told;
    told.emplace();
    tell(*told, {}, *config);
    (*told)["reset_every_s"] = text_of(options.reset_every_s);
    (*told)["seconds"] = text_of(options.seconds);
    return told;
  });
  test::expect_all_options(kRows, help_of(chaos::declare_chaos));
}

TEST(ToolOptionTable, OfLoad) {
  const OptionRow kRows[] = {{"--connect", {"other:81"}, {{"connect", "other:81"}}},
                             {"--token", {"secret"}, {{"token", "secret"}}},
                             {"--token-file", {"t"}, {{"token_file", "t"}}},
                             {"--tls", {}, {{"is_tls", "true"}}},
                             {"--tls-ca", {"ca.pem"}, {{"tls_authorities", "ca.pem"}}},
                             {"--viewers", {"7"}, {{"viewers", "7"}}},
                             {"--frame-viewers", {"7"}, {{"frame_viewers", "7"}}},
                             {"--silent-viewers", {"7"}, {{"silent_viewers", "7"}}},
                             {"--stalled-viewers", {"7"}, {{"stalled_viewers", "7"}}},
                             {"--seconds", {"7"}, {{"seconds", "7"}}},
                             {"--warm-up", {"7"}, {{"warm_up_s", "7"}}},
                             {"--churn-ms", {"7"}, {{"churn_ms", "7"}}},
                             {"--server-pid", {"7"}, {{"server_pid", "7"}}}};
  test::expect_changes(std::span(kRows), [](const Arguments& arguments) {
    test::FieldTexts told;
    tell(told, {}, parse(load::declare_load, arguments));
    return std::optional(told);
  });
  test::expect_all_options(kRows, help_of(load::declare_load));
}

}  // namespace
}  // namespace strandcast::tool_options_test
