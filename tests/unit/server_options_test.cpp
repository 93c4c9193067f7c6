// Every option of strandcast-server: the field that it sets, and that it sets no other.
#include "server/app/options.h"
#include "tests/support/option_table.h"

namespace strandcast::test {

inline void tell(FieldTexts& told, const std::string& where, const Address& all) {
  OPTION_FIELDS(all, host, port, is_tls, session);
}
inline void tell(FieldTexts& told, const std::string& where, const UpstreamOptions& all) {
  OPTION_FIELDS(all, address, token_path, tls_authorities, head);
}
inline void tell(FieldTexts& told, const std::string& where, const MocapOptions& all) {
  OPTION_FIELDS(all, inputs, subject, axes, timecode, scale);
}
inline void tell(FieldTexts& told, const std::string& where, const TlsFiles& all) {
  OPTION_FIELDS(all, certificate, key);
}
inline void tell(FieldTexts& told, const std::string& where, const RecordConfig& all) {
  OPTION_FIELDS(all, path, if_present, keyframe_s);
}
inline void tell(FieldTexts& told, const std::string& where, const RecordFolder& all) {
  OPTION_FIELDS(all, path, free_bytes, file_ending, beginning);
}
inline void tell(FieldTexts& told, const std::string& where, const std::vector<AddressRange>& all) {
  std::string text;
  for (const AddressRange& range : all)
    text += fmt::format("{}/{};", range.first.to_string(), range.bit_count);
  told[where + "ranges"] = text;
}
inline void tell(FieldTexts& told, const std::string& where, const std::vector<HeadSend>& all) {
  std::string text;
  for (const HeadSend& send : all) text += fmt::format("{} {};", send.protocol, send.to.to_string());
  told[where + "all"] = text;
}
// No option sets these: a server's start does.
inline void tell(FieldTexts&, const std::string&, const SceneDesc&) {}
inline void tell(FieldTexts&, const std::string&, const PageFiles&) {}
inline void tell(FieldTexts& told, const std::string& where, const std::vector<AccessToken>& all) {
  told[where + "count"] = text_of(all.size());
}
inline void tell(FieldTexts& told, const std::string& where, const NetLimits& all) {
  OPTION_FIELDS(all, sessions, sessions_per_address, handshake_ms, idle_ms, stalled_ms, unused_ms,
                keyframe_interval_ms, close_ms, link_interval_ms, link_memory_ms, messages_per_s,
                connections_per_s, requests_per_s, wrong_tokens, wrong_token_window_ms, wrong_token_block_ms,
                guarded_addresses, refusal_lines_per_address, refusal_lines, session_lines,
                viewer_bytes_per_s);
}
inline void tell(FieldTexts& told, const std::string& where, const NetConfig& all) {
  OPTION_FIELDS(all, address, port, socket, tokens, loopback_trust, tls, plain_access, allowed_hosts,
                allowed_origins, trusted_proxies, proxy_protocol, limits, page);
}
inline void tell(FieldTexts& told, const std::string& where, const Timecode& all) {
  told[where + "count"] = fmt::format("{}{}", frame_rate_text(all.rate.hz()), all.is_drop ? "df" : "");
}
inline void tell(FieldTexts& told, const std::string& where, const StageClock& all) {
  told[where + "name"] = all.name();
}
inline void tell(FieldTexts& told, const std::string& where, const ServerConfig& all) {
  OPTION_FIELDS(all, scene, net, sim_device, gl_device, renderer, shader_folder, on_publish, timecode, clock,
                is_lockstep, trace_path, make_painter, is_drawn_by_processors, make_source, fallback_codec,
                live_allowed, sends, record, record_folder, tap, shared);
}
inline void tell(FieldTexts& told, const std::string& where, const ServerOptions& all) {
  OPTION_FIELDS(all, scene_path, overrides, mocap, token_path, port_path, log_level, has_json_log, run_s,
                explained_frame_viewers, is_listing_solvers, is_explaining, is_printing_scene, is_checking,
                check_folder, replay_path, replay_pace, upstream, help, config);
}

}  // namespace strandcast::test

namespace strandcast::server_options_test {
namespace {

using test::OptionRow;
using test::text_of;

Result<ServerOptions> parse(const test::Arguments& given) {
  std::vector<const char*> arguments{"strandcast-server"};
  for (const std::string& word : given) arguments.push_back(word.c_str());
  return parse_options(static_cast<int>(arguments.size()), arguments.data());
}

std::optional<test::FieldTexts> fields_of(const test::Arguments& given) {
  const auto options = parse(given);
  if (!options) return std::nullopt;
  test::FieldTexts told;
  tell(told, {}, *options);
  return told;
}

const std::vector<std::string> kTls = {"--tls-cert", "c.pem", "--tls-key", "k.pem"};
const std::vector<std::string> kUpstream = {"--upstream", "studio:83"};

const OptionRow kSceneRows[] = {
    {"--scene", {"x.textproto"}, {{"scene_path", "x.textproto"}}},
    {"--set", {"substeps=2", "--set", "wind.seed=7"}, {{"overrides", "substeps=2 wind.seed=7"}}},
    {"--groom", {"a.tfx"}, {{"overrides", "groom.file.path=a.tfx head.radius_m=0"}}},
    {"--groom", {"a.tfx"}, {{"overrides", "groom.file.path=a.tfx"}}, {"--scene", "x.textproto"}},
    {"--check", {}, {{"is_checking", "true"}}},
    {"--check", {"a.tfx"}, {{"is_checking", "true"}, {"overrides", "groom.file.path=a.tfx head.radius_m=0"}}},
    {"--out", {"seen"}, {{"check_folder", "seen"}}, {"--check"}},
    {"--list-solvers", {}, {{"is_listing_solvers", "true"}}},
    {"--explain", {}, {{"is_explaining", "true"}}},
    {"--explain", {"x.textproto"}, {{"is_explaining", "true"}, {"scene_path", "x.textproto"}}},
    {"--frame-viewers", {"3"}, {{"explained_frame_viewers", "3"}}},
    {"--print-scene", {}, {{"is_printing_scene", "true"}}},
    {"--mocap-timecode", {"25"}, {{"mocap.timecode", "25"}}, {"--mocap", "freed"}},
    {"--mocap", {"vmc", "--mocap", "freed:5"}, {{"mocap.inputs", "vmc freed:5"}}},
    {"--mocap-subject", {"Zoe"}, {{"mocap.subject", "Zoe"}}, {"--mocap", "vmc"}},
    {"--mocap-axes", {"ypr-xyz"}, {{"mocap.axes", "ypr-xyz"}}, {"--mocap", "vmc"}},
    {"--mocap-scale", {"0.5"}, {{"mocap.scale", "0.5"}}, {"--mocap", "vmc"}},
    {"--send",
     {"vmc", "--send", "freed://10.0.0.5:7"},
     {{"config.sends.all", "vmc 127.0.0.1:39539;freed 10.0.0.5:7;"}}},
    {"--mocap-allow", {"10.0.0.0/8"}, {{"config.live_allowed.ranges", "10.0.0.0/104;"}}},
    {"--record",
     {"a.mcap"},
     {{"config.record", "some"},
      {"config.record.path", "a.mcap"},
      {"config.record.if_present", text_of(IfPresent::Refuse)},
      {"config.record.keyframe_s", "0"}}},
    {"--record-replace",
     {},
     {{"config.record.if_present", text_of(IfPresent::Replace)}},
     {"--record", "a.mcap"}},
    {"--record-exact", {"10"}, {{"config.record.keyframe_s", "10"}}, {"--record", "a.mcap", "--lockstep"}},
    {"--record-dir",
     {"takes"},
     {{"config.record_folder", "some"},
      {"config.record_folder.path", "takes"},
      {"config.record_folder.free_bytes", "some"},
      {"config.record_folder.file_ending", ""},
      {"config.record_folder.beginning", "some"}}},
    {"--replay", {"a.mcap"}, {{"replay_path", "a.mcap"}}},
    {"--replay-realtime", {}, {{"replay_pace", text_of(ReplayPace::RealTime)}}, {"--replay", "a.mcap"}},
    {"--upstream",
     {"wss://studio:83/s/anna"},
     {{"upstream", "some"},
      {"upstream.address.host", "studio"},
      {"upstream.address.port", "83"},
      {"upstream.address.is_tls", "true"},
      {"upstream.address.session", "anna"},
      {"upstream.token_path", ""},
      {"upstream.tls_authorities", ""},
      {"upstream.head", ""}}},
    {"--upstream-token-file", {"t"}, {{"upstream.token_path", "t"}}, kUpstream},
    {"--upstream-tls-ca", {"ca.pem"}, {{"upstream.tls_authorities", "ca.pem"}}, kUpstream},
    {"--upstream-head", {"ben"}, {{"upstream.head", "ben"}}, kUpstream}};

const OptionRow kRunRows[] = {
    {"--listen", {"::1"}, {{"config.net.address", "::1"}}},
    {"--port", {"81"}, {{"config.net.port", "81"}}},
    {"--port-file", {"p"}, {{"port_path", "p"}}},
    {"--token-file", {"t"}, {{"token_path", "t"}}},
    {"--distrust-loopback", {}, {{"config.net.loopback_trust", text_of(LoopbackTrust::LikeAllOthers)}}},
    {"--allow-host", {"a", "--allow-host", "b"}, {{"config.net.allowed_hosts", "a b"}}},
    {"--allow-origin", {"https://a"}, {{"config.net.allowed_origins", "https://a"}}},
    {"--tls-cert",
     {"c.pem", "--tls-key", "k.pem"},
     {{"config.net.tls", "some"}, {"config.net.tls.certificate", "c.pem"}, {"config.net.tls.key", "k.pem"}}},
    {"--tls-key",
     {"k.pem", "--tls-cert", "c.pem"},
     {{"config.net.tls", "some"}, {"config.net.tls.certificate", "c.pem"}, {"config.net.tls.key", "k.pem"}}},
    {"--tls-only", {}, {{"config.net.plain_access", text_of(PlainAccess::Nobody)}}, kTls},
    {"--trusted-proxy",
     {"10.0.0.7", "--trusted-proxy", "10.1.0.0/16"},
     {{"config.net.trusted_proxies.ranges", "10.0.0.7/128;10.1.0.0/112;"}}},
    {"--proxy-protocol",
     {},
     {{"config.net.proxy_protocol", text_of(ProxyProtocol::Version2)}},
     {"--trusted-proxy", "10.0.0.7"}},
    {"--viewer-mbit", {"8"}, {{"config.net.limits.viewer_bytes_per_s", "1000000"}}},
    {"--sim-device", {"lanes"}, {{"config.sim_device", "lanes"}}},
    {"--renderer", {"tiles"}, {{"config.renderer", "tiles"}}},
    {"--gl-device", {"software"}, {{"config.gl_device", "software"}}},
    {"--shader-dir", {"s"}, {{"config.shader_folder", "s"}}},
    {"--log-level", {"debug"}, {{"log_level", "debug"}}},
    {"--log-format", {"json"}, {{"has_json_log", "true"}}},
    {"--timecode", {"29.97df"}, {{"config.timecode", "some"}, {"config.timecode.count", "29.97df"}}},
    {"--timecode-clock", {"utc"}, {{"config.clock.name", "utc"}}},
    {"--trace", {"t.csv"}, {{"config.trace_path", "t.csv"}}},
    {"--lockstep", {}, {{"config.is_lockstep", "true"}}},
    {"--seconds", {"2.5"}, {{"run_s", "2.5"}}},
    {"--max-sessions", {"7"}, {{"config.net.limits.sessions", "7"}}},
    {"--max-sessions-per-address", {"7"}, {{"config.net.limits.sessions_per_address", "7"}}},
    {"--connections-per-s", {"7"}, {{"config.net.limits.connections_per_s", "7"}}},
    {"--messages-per-s", {"70"}, {{"config.net.limits.messages_per_s", "70"}}},
    {"--wrong-tokens", {"7"}, {{"config.net.limits.wrong_tokens", "7"}}},
    {"--wrong-token-window-ms", {"7000"}, {{"config.net.limits.wrong_token_window_ms", "7000"}}},
    {"--wrong-token-block-ms", {"7000"}, {{"config.net.limits.wrong_token_block_ms", "7000"}}},
    {"--handshake-ms", {"700"}, {{"config.net.limits.handshake_ms", "700"}}},
    {"--idle-ms", {"7000"}, {{"config.net.limits.idle_ms", "7000"}}},
    {"--stalled-ms", {"700"}, {{"config.net.limits.stalled_ms", "700"}}}};

std::vector<OptionRow> all_rows() {
  std::vector<OptionRow> rows(std::begin(kSceneRows), std::end(kSceneRows));
  rows.insert(rows.end(), std::begin(kRunRows), std::end(kRunRows));
  return rows;
}

TEST(ServerOptionTable, EveryOptionChangesItsFieldAndNoOther) {
  const std::vector<OptionRow> rows = all_rows();
  test::expect_changes(rows, fields_of);
  test::expect_all_options(rows, parse({"--help"})->help);
}

TEST(ServerOptionTable, NumbersEndWhereTheyAreSaidTo) {
  const test::OptionRange kRanges[] = {{"--max-sessions", "0", "1", "256", "257"},
                                       {"--max-sessions-per-address", "0", "1", "256", "257"},
                                       {"--connections-per-s", "0.99", "1", "10000", "10001"},
                                       {"--messages-per-s", "9.9", "10", "10000", "10001"},
                                       {"--wrong-tokens", "-1", "0", "1000", "1001"},
                                       {"--wrong-token-window-ms", "999", "1000", "86400000", "86400001"},
                                       {"--wrong-token-block-ms", "999", "1000", "86400000", "86400001"},
                                       {"--handshake-ms", "99", "100", "60000", "60001"},
                                       {"--idle-ms", "999", "1000", "600000", "600001"},
                                       {"--stalled-ms", "499", "500", "60000", "60001"},
                                       {"--frame-viewers", "-1", "0", "10000", "10001"},
                                       {"--viewer-mbit", "-1", "0", "1000000", "1000001"},
                                       {"--seconds", "-1", "0", "1000000000", "1000000001"},
                                       {"--port", "-1", "0", "65535", "65536"}};
  test::expect_ranges(kRanges, [](const test::Arguments& arguments) { return parse(arguments).ok(); });
}

// Taken in silence, each would do nothing.
TEST(ServerOptionTable, WhatLetsNobodyInAndWhatIsGivenTwiceIsTold) {
  for (const char* origin : {"foo", "https://", "https://a.example/page", "https://a b", "://"})
    EXPECT_FALSE(parse({"--allow-origin", origin})) << origin;
  for (const char* origin : {"https://a.example", "http://[::1]:8080"})
    EXPECT_TRUE(parse({"--allow-origin", origin})) << origin;
  const auto twice = parse({"--mocap", "vmc", "--mocap", "freed", "--mocap", "vmc"});
  ASSERT_FALSE(twice);
  EXPECT_EQ(twice.error().message, "--mocap vmc is given twice");
  EXPECT_TRUE(parse({"--mocap", "vmc:1", "--mocap", "vmc:2"}));
}

// A word of a fixed list that says what goes without it changes nothing: the other words do, as above.
TEST(ServerOptionTable, WhatIsSaidAnywayChangesNothing) {
  for (const auto& said : {test::Arguments{"--log-format", "text"},
                           {"--log-level", "info"},
                           {"--viewer-mbit", "0"},
                           {"--sim-device", "auto"},
                           {"--listen", "127.0.0.1"}})
    EXPECT_EQ(fields_of(said), fields_of({})) << said[0];
}

}  // namespace
}  // namespace strandcast::server_options_test
