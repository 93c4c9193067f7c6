#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "common/base/units.h"
#include "common/replay/clock_offset.h"
#include "common/scene/scene_fields.h"
#include "common/strands/frame_header.h"
#include "common/wire/messages.h"
#include "tests/support/sample_messages.h"

namespace strandcast::wire_messages_test {
namespace {

using testing::HasSubstr;

template <class Message>
Message round_trip(const Message& message) {
  const auto decoded = [&] {
    if constexpr (std::is_constructible_v<ClientMessage, Message>)
      return decode_client_message(encode(ClientMessage(message)));
    else
      return decode_server_message(encode(ServerMessage(message)));
  }();
  EXPECT_TRUE(decoded) << decoded.error().to_string();
  if (!decoded || !std::holds_alternative<Message>(*decoded)) {
    ADD_FAILURE() << "another kind of message came back";
    return {};
  }
  return std::get<Message>(*decoded);
}

TEST(WireMessages, EncodingIsStableThroughARoundTrip) {
  for (const auto& message : sample_client_messages()) {
    const auto bytes = encode(message);
    EXPECT_EQ(bytes[0], static_cast<std::byte>(Opcode::Control));
    const auto decoded = decode_client_message(bytes);
    ASSERT_TRUE(decoded) << decoded.error().to_string();
    EXPECT_EQ(decoded->index(), message.index());
    EXPECT_EQ(encode(*decoded), bytes);
  }
  for (const auto& message : sample_server_messages()) {
    const auto bytes = encode(message);
    const auto decoded = decode_server_message(bytes);
    ASSERT_TRUE(decoded) << decoded.error().to_string();
    EXPECT_EQ(decoded->index(), message.index());
    EXPECT_EQ(encode(*decoded), bytes);
  }
}

// The samples set every field of every message; tests/conformance sees to that.
TEST(WireMessages, EveryFieldComesBack) {
  for (const ClientMessage& message : sample_client_messages()) {
    const auto decoded = decode_client_message(encode(message));
    EXPECT_TRUE(decoded && *decoded == message) << "client message " << message.index();
  }
  for (const ServerMessage& message : sample_server_messages()) {
    const auto decoded = decode_server_message(encode(message));
    EXPECT_TRUE(decoded && *decoded == message) << "server message " << message.index();
  }
}

/// The values of a look or camera by name.
struct FieldValues {
  template <class Value>
  void number(const char* name, Value& value, const scene_fields::Range&) {
    values[name] = {static_cast<double>(value)};
  }
  void text(const char* name, const std::string& value, size_t) {
    values[name] = {static_cast<double>(std::hash<std::string>()(value))};
  }
  template <class Body>
  void group(const char*, Body body) {
    body();
  }
  void vector(const char* name, const glm::vec3& value, const scene_fields::Range&) {
    values[name] = {value.x, value.y, value.z};
  }
  void color(const char* name, const glm::vec3& value, const scene_fields::Range& range) {
    vector(name, value, range);
  }
  void require(const char* name, bool holds, const char* what) { EXPECT_TRUE(holds) << name << " " << what; }
  std::map<std::string, std::vector<double>> values;
};

// A field that is lost on its way comes back as the default: the sample has none of these.
TEST(WireMessages, TheSampleOfALookHasNoDefaultInIt) {
  LookDesc look = sample_look(), usual_look;
  CameraDesc camera = sample_camera(), usual_camera;
  FieldValues sample, usual;
  scene_fields::visit_look(sample, look);
  scene_fields::visit_look(usual, usual_look);
  scene_fields::visit_camera(sample, camera);
  scene_fields::visit_camera(usual, usual_camera);
  EXPECT_EQ(sample.values.size(), 56u);
  // A vector or colour is lost as a whole.
  for (const auto& [name, values] : sample.values) EXPECT_NE(values, usual.values.at(name)) << name;
}

TEST(WireMessages, EveryEnumeratorComesBack) {
  for (const Command command : {Command::Pause, Command::Resume, Command::StepOnce, Command::Reset})
    EXPECT_EQ(round_trip(ControlCommand{command}).command, command);
  for (const Role role : {Role::Viewer, Role::Controller, Role::Source, Role::Admin}) {
    Hello one;
    one.role = role;
    EXPECT_EQ(round_trip(one).role, role);
  }
  for (const AdminAction action : {AdminAction::ListSessions, AdminAction::Kick, AdminAction::ShutDown})
    EXPECT_EQ(round_trip(AdminCommand{action, 1ull << 63}), (AdminCommand{action, 1ull << 63}));
  for (const DrawingDevice device :
       {DrawingDevice::Unknown, DrawingDevice::None, DrawingDevice::Software, DrawingDevice::Hardware})
    EXPECT_EQ(round_trip(ViewerReport{0.0, 0.0, 0.0, 0.0, device, 0.0}).device, device);
  for (const StreamMode mode : {StreamMode::Strands, StreamMode::Frames, StreamMode::Auto})
    EXPECT_EQ(round_trip(ModeRequest{mode}).mode, mode);
  for (const PictureCodec codec : kPictureCodecs)
    EXPECT_EQ(round_trip(FrameQuality{0x8001, 320, 180, 7.5, 30, codec, ""}).codec, codec);
}

// What a message does not say keeps the default of looks and cameras, and is 0 or false everywhere else.
TEST(WireMessages, MissingFieldsHaveTheirDefaults) {
  const std::vector<std::byte> empty_status = {std::byte{1}, std::byte{0x1a}, std::byte{0}};
  const auto status = decode_server_message(empty_status);
  ASSERT_TRUE(status) << status.error().to_string();
  EXPECT_FALSE(std::get<ServerStatus>(*status).is_motion_stale);
  const std::vector<std::byte> empty_camera = {std::byte{1}, std::byte{0x22}, std::byte{0}};
  const auto camera = decode_client_message(empty_camera);
  ASSERT_TRUE(camera) << camera.error().to_string();
  EXPECT_EQ(std::get<CameraChange>(*camera).camera, CameraDesc());
}

TEST(WireMessages, ImpossiblePosesReachTheInputHubToBeCounted) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  MotionSamples motion;
  motion.samples.push_back({1, {{nan, 0.0, 0.0}, {0.0, 0.0, 0.0, 0.0}}});
  motion.samples.push_back({0, {{1e300, 0.0, 0.0}, {nan, 0.0, INFINITY, 0.0}}});
  const auto back = round_trip(motion);
  ASSERT_EQ(back.samples.size(), 2u);
  EXPECT_TRUE(std::isnan(back.samples[0].world_from_head.position_m.x));
  EXPECT_EQ(back.samples[0].world_from_head.rotation.w, 0.0);
  EXPECT_TRUE(std::isnan(back.samples[1].world_from_head.rotation.w));
  WindSamples wind;
  wind.samples.push_back({1, {std::numeric_limits<float>::quiet_NaN(), 0.0f, 0.0f}});
  EXPECT_TRUE(std::isnan(round_trip(wind).samples[0].velocity_mps.x));
}

TEST(WireMessages, SamplesPerMessageLimitIsExactAndFitsTheByteLimit) {
  MotionSamples motion;
  motion.samples.resize(kMaxSamplesPerMessage, {INT64_MAX, {glm::dvec3(1e300), {1.0, 2.0, 3.0, 4.0}}});
  EXPECT_LE(encode(ClientMessage(motion)).size(), kMaxControlBytes);
  EXPECT_EQ(round_trip(motion).samples.size(), kMaxSamplesPerMessage);
  motion.samples.emplace_back();
  const auto refused = decode_client_message(encode(ClientMessage(motion)));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(refused.error().place, "motion.samples");
  WindSamples wind;
  wind.samples.resize(kMaxSamplesPerMessage + 1);
  EXPECT_EQ(decode_client_message(encode(ClientMessage(wind))).error().code, ErrorCode::LimitExceeded);
}

TEST(WireMessages, JointsOfTheBodyAreBoundedAndTheLargestMessageFits) {
  MotionSamples motion;
  for (size_t i = 0; i < kMaxMotionJoints; ++i)
    motion.joint_names.push_back(std::string(kMaxJointNameBytes - 1, 'j') + static_cast<char>('a' + i));
  MotionSamples::Sample sample{INT64_MAX, {glm::dvec3(1e300), {1.0, 2.0, 3.0, 4.0}}};
  sample.joint_m.resize(kMaxMotionJoints, glm::vec3(std::numeric_limits<float>::infinity()));
  motion.samples.resize(kMaxSamplesPerMessage, sample);
  EXPECT_LE(encode(ClientMessage(motion)).size(), kMaxControlBytes);
  EXPECT_EQ(round_trip(motion), motion) << "values are for the input hub to judge";
  const auto refused = [](MotionSamples wrong) {
    const auto decoded = decode_client_message(encode(ClientMessage(std::move(wrong))));
    return decoded ? std::string("taken") : decoded.error().to_string();
  };
  motion.samples = {sample};
  MotionSamples wrong = motion;
  wrong.joint_names.emplace_back("one more");
  EXPECT_THAT(refused(wrong), testing::HasSubstr("motion.joint_names: has length 13, the limit is 12"));
  wrong = motion;
  wrong.joint_names.back() += 'x';
  EXPECT_THAT(refused(wrong), testing::HasSubstr("motion.joint_names: has length 33, the limit is 32"));
  wrong = motion;
  wrong.joint_names.back() = wrong.joint_names.front();
  EXPECT_THAT(refused(wrong), testing::HasSubstr("motion.joint_names: has a name twice"));
  wrong = motion;
  wrong.joint_names.back().clear();
  EXPECT_THAT(refused(wrong), testing::HasSubstr("motion.joint_names: has an empty name"));
  wrong = motion;
  wrong.samples[0].joint_m.emplace_back();
  EXPECT_THAT(refused(wrong), testing::HasSubstr("samples.joint_m: has length 39, the limit is 36"));
}

TEST(WireMessages, WhatEncodeMakesOfAnyTextDecodes) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 300; ++trial) {
    std::string text(random() % 3000, ' ');
    for (char& character : text) character = static_cast<char>(random());
    EXPECT_TRUE(decode_server_message(encode(ServerMessage(Goodbye{text}))));
    EXPECT_TRUE(decode_server_message(encode(ServerMessage(Notice{false, text}))));
    Hello hello;
    hello.name = text;
    EXPECT_TRUE(decode_client_message(encode(ClientMessage(hello))));
  }
  EXPECT_EQ(round_trip(Goodbye{"line\nbreak \xff end"}).reason, "line break ? end");
  const std::string longest(kMaxTextChars, 'a');
  Goodbye too_long;
  too_long.reason = longest;
  too_long.reason.push_back('b');
  EXPECT_EQ(round_trip(too_long).reason, longest);
  std::string long_name;
  for (size_t i = 0; i < kMaxNameChars; ++i) long_name += "é";  // two bytes each: the limit counts characters
  Hello hello;
  hello.name = long_name + "é";
  EXPECT_EQ(round_trip(hello).name, long_name);
}

Result<ServerMessage> send_welcome(const std::function<void(Welcome&)>& change) {
  auto welcome = std::get<Welcome>(sample_server_messages()[0]);
  change(welcome);
  return decode_server_message(encode(ServerMessage(welcome)));
}

TEST(WireMessages, WelcomeFieldsOutOfRangeAreNamed) {
  ASSERT_TRUE(send_welcome([](Welcome&) {}));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<std::pair<std::string, std::function<void(Welcome&)>>> changes = {
      {"welcome.session_id", [](Welcome& w) { w.session_id = "0123456789ABCDEF"; }},
      {"welcome.session_id", [](Welcome& w) { w.session_id.pop_back(); }},
      {"welcome.mode", [](Welcome& w) { w.mode = StreamMode::Auto; }},
      {"welcome.codec", [](Welcome& w) { w.codec = std::string(65, 'x'); }},
      {"welcome.codec", [](Welcome& w) { w.codec = "del\nta"; }},
      {"welcome.strand_count", [](Welcome& w) { w.strand_count = 0; }},
      {"welcome.strand_count", [](Welcome& w) { w.strand_count = kMaxStrandCount + 1; }},
      {"welcome.vertex_count", [](Welcome& w) { w.vertex_count = 1; }},
      {"welcome.vertex_count", [](Welcome& w) { w.vertex_count = 65; }},
      {"welcome.bound_m", [](Welcome& w) { w.bound_m = 0.0f; }},
      {"welcome.bound_m", [&](Welcome& w) { w.bound_m = nan; }},
      {"welcome.step_rate_hz", [](Welcome& w) { w.step_rate_hz = 1e9; }},
      {"welcome.frame_width", [](Welcome& w) { w.frame_width = 4097; }},
      {"welcome.frame_height", [](Welcome& w) { w.frame_height = 1; }},
      {"look.root_color", [&](Welcome& w) { w.look.root_color.y = nan; }},
      {"look.segments", [](Welcome& w) { w.look.segments = 9; }},
      {"look.followers", [](Welcome& w) { w.look.followers = 1000; }},
      {"look.light_direction", [](Welcome& w) { w.look.light_direction = glm::vec3(0.0f); }},
      {"methods.shading", [](Welcome& w) { w.look.methods.shading = "phong"; }},
      {"camera.offset_m", [](Welcome& w) { w.camera.offset_m = glm::vec3(0.0f); }},
      {"camera.target_m", [](Welcome& w) { w.camera.target_m.z = 1e9f; }},
      {"camera.fov_y_rad", [&](Welcome& w) { w.camera.fov_y_rad = nan; }},
  };
  for (const auto& [field, change] : changes) {
    const auto refused = send_welcome(change);
    ASSERT_FALSE(refused) << field;
    EXPECT_EQ(refused.error().place, field);
  }
}

TEST(WireMessages, ALookThatCannotBeIsNamed) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<std::pair<std::string, std::function<void(LookChange&)>>> changes = {
      {"look.hair_color", [](LookChange& c) { c.look.hair_color = "purple"; }},
      {"look.ambient", [&](LookChange& c) { c.look.ambient = nan; }},
      {"look.light_direction", [](LookChange& c) { c.look.light_direction = glm::vec3(0.0f); }},
      {"look.rim_direction", [](LookChange& c) { c.look.rim_direction = glm::vec3(0.0f); }},
      {"style.locks", [](LookChange& c) { c.look.style.locks = 17; }},
      {"shading.wetness", [&](LookChange& c) { c.look.shading.wetness = 1.5f; }},
      {"camera.offset_m", [](LookChange& c) { c.camera.offset_m = glm::vec3(0.0f); }},
  };
  for (const auto& [field, change] : changes) {
    LookChange look{sample_look(), sample_camera()};
    ASSERT_EQ(round_trip(look), look);
    change(look);
    const auto refused = decode_server_message(encode(ServerMessage(look)));
    ASSERT_FALSE(refused) << field;
    EXPECT_EQ(refused.error().place, field);
  }
}

TEST(WireMessages, TheLongestStatusFits) {
  const auto wide = [](size_t count) {
    std::string text;
    for (size_t i = 0; i < count; ++i) text += "\U0001f488";  // four bytes of UTF-8
    return text;
  };
  LiveInputStatus input;
  input.input = wide(kMaxLiveInputChars);
  input.sender = wide(kMaxAddressChars);
  input.subject = wide(kMaxNameChars);
  input.subjects = wide(kMaxLiveSubjectsChars);
  input.packets = input.received_bytes = input.refused = input.lost = UINT64_MAX;
  input.values.assign(kMaxLiveValues, LiveValue{wide(kMaxLiveValueChars)});
  ServerStatus status;
  status.slow_motion = status.detail = wide(kMaxTextChars);
  status.picture_motions.assign(kMaxPictureMotions, PictureMotion{INT64_MAX, INT64_MAX});
  status.live_inputs.assign(kMaxLiveInputs, input);
  status.recording = wide(kMaxTextChars);
  status.timecode = Timecode{{60'000, 1001}, true, 5'178'815, 0.1};
  EXPECT_LE(encode(ServerMessage(status)).size(), kMaxControlBytes);
  EXPECT_EQ(round_trip(status), status);
  status.live_inputs.push_back(input);
  EXPECT_FALSE(decode_server_message(encode(ServerMessage(status))));
}

TEST(WireMessages, ASceneIsOneLineOfLimitedLength) {
  const SceneText longest{std::string(kMaxSceneTextBytes, 'x')};
  EXPECT_LE(encode(ServerMessage(longest)).size(), kMaxControlBytes);
  EXPECT_EQ(round_trip(longest), longest);
  for (const std::string& text : {longest.text + "x", std::string("two\nlines")}) {
    const auto refused = decode_server_message(encode(ServerMessage(SceneText{text})));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().place, "scene_text.text");
  }
}

TEST(WireMessages, StatusNumbersMustBeFinite) {
  ServerStatus status;
  status.realtime_factor = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(decode_server_message(encode(ServerMessage(status))).error().place, "status.realtime_factor");
  status.realtime_factor = -1.0;
  EXPECT_FALSE(decode_server_message(encode(ServerMessage(status))));
}

TEST(WireMessages, StreamQualityIsCheckedFieldByField) {
  const StreamQuality good{3, 4, 0.5f, 5e-4f, "slow"};
  const auto place_after = [&](auto change) {
    StreamQuality quality = good;
    change(quality);
    return decode_server_message(encode(ServerMessage(quality))).error().place;
  };
  EXPECT_EQ(place_after([](StreamQuality& q) { q.rate_divisor = 0; }), "quality.rate_divisor");
  EXPECT_EQ(place_after([](StreamQuality& q) { q.rate_divisor = kMaxRateDivisor + 1; }),
            "quality.rate_divisor");
  EXPECT_EQ(place_after([](StreamQuality& q) { q.strand_share = 0.0f; }), "quality.strand_share");
  EXPECT_EQ(place_after([](StreamQuality& q) { q.strand_share = 1.5f; }), "quality.strand_share");
  EXPECT_EQ(place_after([](StreamQuality& q) { q.bound_m = std::nanf(""); }), "quality.bound_m");
  EXPECT_EQ(place_after([](StreamQuality& q) { q.codec = std::string(kMaxNameChars + 1, 'x'); }),
            "quality.codec");
  EXPECT_EQ(place_after([](StreamQuality& q) { q.codec = "del\nta"; }), "quality.codec");
}

// A server of before says nothing of it: the codec stays.
TEST(WireMessages, AStreamQualityOfBeforeNamesNoCodec) {
  StreamQuality quality{3, 4, 0.5f, 5e-4f, "slow", "delta"};
  const size_t bytes = encode(ServerMessage(quality)).size();
  quality.codec.clear();
  const auto before = encode(ServerMessage(quality));
  EXPECT_EQ(before.size(), bytes - 2 - std::string("delta").size()) << "nothing is written for it";
  EXPECT_EQ(std::get<StreamQuality>(decode_server_message(before).value()).codec, "");
}

TEST(WireMessages, AsManyStateTimesAsThereMayBeFitIntoOneMessage) {
  StateTimes times{
      std::vector<StateTime>(kMaxStateTimes, {UINT64_MAX, INT64_MIN, INT64_MIN, INT64_MIN, INT64_MIN,
                                              INT64_MIN, Timecode{{60'000, 1001}, true, 5'178'815, 0.1}})};
  const auto bytes = encode(ServerMessage(times));
  EXPECT_LE(bytes.size(), kMaxControlBytes);
  EXPECT_EQ(std::get<StateTimes>(decode_server_message(bytes).value()), times);
  times.states.push_back({});
  const auto refused = decode_server_message(encode(ServerMessage(times)));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::LimitExceeded);
}

TEST(WireMessages, TimecodeThatNobodyCountsIsRefusedAndNoneTakesNoByte) {
  MotionSamples motion;
  const size_t bare_bytes = encode(ClientMessage(motion)).size();
  const auto refusal = [&](const Timecode& timecode) {
    motion.timecode = timecode;
    const auto bytes = encode(ClientMessage(motion));
    EXPECT_GT(bytes.size(), bare_bytes);
    const auto decoded = decode_client_message(bytes);
    return decoded ? std::string() : decoded.error().to_string();
  };
  EXPECT_EQ(refusal({{24, 1}, false, 2'073'599, 0.999}), "");
  EXPECT_EQ(refusal({{60'000, 1001}, true, 5'178'815}), "");
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const Timecode& wrong :
       {Timecode{{24, 1}, false, 2'073'600}, Timecode{{60'000, 1001}, true, 5'178'816}, Timecode{{23, 1}},
        Timecode{{24, 1}, true}, Timecode{{0, 0}}, Timecode{{24, 0}}, Timecode{{24, 1}, false, 0, 1.0},
        Timecode{{24, 1}, false, 0, -0.5}, Timecode{{24, 1}, false, 0, kNan}})
    EXPECT_THAT(refusal(wrong), testing::HasSubstr("timecode: is no frame of a day"));
}

TEST(WireMessages, TheLongestSessionListFitsIntoOneMessage) {
  SessionInfo longest;
  longest.id = longest.sent_bytes = UINT64_MAX;
  for (size_t i = 0; i < kMaxListedNameChars; ++i) longest.name += "\U0001f488";  // four bytes of UTF-8
  longest.address = std::string(kMaxAddressChars, '6');
  longest.role = Role::Admin;
  longest.mode = StreamMode::Frames;
  longest.queue_delay_ms = longest.connected_s = 1e9;
  SessionList list{std::vector<SessionInfo>(kMaxListedSessions, longest)};
  EXPECT_LE(encode(ServerMessage(list)).size(), kMaxControlBytes);
  EXPECT_EQ(round_trip(list).sessions.back().name, longest.name);
  list.sessions[0].name += "x";
  EXPECT_EQ(round_trip(list).sessions[0].name, longest.name) << "a sender shortens";
  list.sessions.push_back({});
  const auto refused = decode_server_message(encode(ServerMessage(list)));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::LimitExceeded);
}

TEST(WireMessages, ViewerReportNumbersMustBeFiniteAndInRange) {
  using Field = double ViewerReport::*;
  const std::vector<std::tuple<std::string, Field, double>> fields = {
      {"viewer_report.decode_ms", &ViewerReport::decode_ms, kMaxReportedMs},
      {"viewer_report.draw_ms", &ViewerReport::draw_ms, kMaxReportedMs},
      {"viewer_report.picture_decode_ms", &ViewerReport::picture_decode_ms, kMaxReportedMs},
      {"viewer_report.hair_px", &ViewerReport::hair_px, kMaxReportedPx},
      {"viewer_report.step_ns", &ViewerReport::step_ns, kMaxStepNs},
      {"viewer_report.shown_hz", &ViewerReport::shown_hz, kMaxReportedHz}};
  for (const auto& [name, field, limit] : fields) {
    ViewerReport report;
    report.*field = limit;
    EXPECT_TRUE(decode_client_message(encode(ClientMessage(report)))) << name;
    for (const double bad : {std::nan(""), double{INFINITY}, -double{INFINITY}, -1.0, 1.001 * limit}) {
      report.*field = bad;
      const auto refused = decode_client_message(encode(ClientMessage(report)));
      ASSERT_FALSE(refused) << name << " = " << bad;
      EXPECT_EQ(refused.error().place, name);
    }
  }
}

TEST(WireMessages, WhatAViewerSaysOfPredictingIsChecked) {
  const auto say = [](double step_ns, const std::string& codec_wish) {
    Hello hello;
    hello.step_ns = step_ns;
    hello.codec_wish = codec_wish;
    return decode_client_message(encode(ClientMessage(hello)));
  };
  for (const double good : {0.0, 1e-3, 25.0, kMaxStepNs})
    EXPECT_EQ(std::get<Hello>(say(good, "").value()).step_ns, good);
  for (const double bad : {std::nan(""), double{INFINITY}, -double{INFINITY}, -1e-3, 1.001 * kMaxStepNs}) {
    const auto refused = say(bad, "");
    ASSERT_FALSE(refused) << bad;
    EXPECT_EQ(refused.error().place, "hello.step_ns");
  }
  const std::string longest(kMaxNameChars, 'x');
  EXPECT_EQ(std::get<Hello>(say(0.0, longest).value()).codec_wish, longest);
  for (const std::string& bad : {longest + "x", std::string("tan\ngent"), std::string("\x7f")}) {
    const auto refused = say(0.0, bad);
    ASSERT_FALSE(refused) << bad;
    EXPECT_EQ(refused.error().place, "hello.codec_wish");
  }
}

// A client of before says nothing of it: it cannot predict, and insists on nothing.
TEST(WireMessages, AHelloOfBeforeCannotPredict) {
  const std::vector<std::byte> empty_hello = {std::byte{1}, std::byte{0x0a}, std::byte{0}};
  const auto hello = decode_client_message(empty_hello);
  ASSERT_TRUE(hello) << hello.error().to_string();
  EXPECT_EQ(std::get<Hello>(*hello).step_ns, 0.0);
  EXPECT_EQ(std::get<Hello>(*hello).codec_wish, "");
}

// Wider on the wire than in the struct: a number that does not fit is refused, not cut.
TEST(WireMessages, StreamNumbersBeyondTheirRangeAreRefused) {
  // frame_ack (field 6) { stream_id (field 4) = 65,536 }
  std::vector<std::byte> bytes;
  for (const int byte : {0x01, 0x32, 0x04, 0x20, 0x80, 0x80, 0x04})
    bytes.push_back(static_cast<std::byte>(byte));
  const auto refused = decode_client_message(bytes);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().to_string(), "frame_ack.stream_id: is 65536, it must be within 0 .. 65535");
}

TEST(WireMessages, ModeChangeIsCheckedFieldByField) {
  const auto place_of = [](const ModeChange& change) {
    return decode_server_message(encode(ServerMessage(change))).error().place;
  };
  EXPECT_EQ(place_of({StreamMode::Auto, "", 0, 0}), "mode_change.mode");
  EXPECT_EQ(place_of({StreamMode::Frames, "", 15, 360}), "mode_change.frame_width");
  EXPECT_EQ(place_of({StreamMode::Frames, "", 640, 4097}), "mode_change.frame_height");
}

TEST(WireMessages, FrameQualityIsCheckedFieldByField) {
  const FrameQuality good{0x8001, 320, 180, 7.5, 30, PictureCodec::Vp8, "slow"};
  const auto place_after = [&](auto change) {
    FrameQuality quality = good;
    change(quality);
    return decode_server_message(encode(ServerMessage(quality))).error().place;
  };
  EXPECT_EQ(place_after([](FrameQuality& q) { q.width = kMaxPictureWidth + 1; }), "frame_quality.width");
  EXPECT_EQ(place_after([](FrameQuality& q) { q.height = 0; }), "frame_quality.height");
  EXPECT_EQ(place_after([](FrameQuality& q) { q.rate_hz = 0.0; }), "frame_quality.rate_hz");
  EXPECT_EQ(place_after([](FrameQuality& q) { q.quality = 101; }), "frame_quality.quality");
  EXPECT_EQ(place_after([](FrameQuality& q) { q.codec = static_cast<PictureCodec>(4); }),
            "frame_quality.codec");
}

TEST(WireMessages, PictureSizesHaveOneLimit) {
  Hello hello;
  hello.frame_width = kMaxPictureWidth;
  hello.frame_height = kMaxPictureHeight;
  EXPECT_TRUE(decode_client_message(encode(ClientMessage(hello))));
  ++hello.frame_width;
  EXPECT_EQ(decode_client_message(encode(ClientMessage(hello))).error().place, "hello.frame_width");
  hello.frame_width = kMinPictureSide;
  ++hello.frame_height;
  EXPECT_EQ(decode_client_message(encode(ClientMessage(hello))).error().place, "hello.frame_height");
  hello.frame_height = kMinPictureSide - 1;
  EXPECT_FALSE(decode_client_message(encode(ClientMessage(hello))));
}

TEST(WireMessages, ClientLimitsAreExact) {
  Hello hello;
  hello.token = std::string(kMaxTokenBytes, 't');
  EXPECT_TRUE(decode_client_message(encode(ClientMessage(hello))));
  hello.token += 't';
  const auto refused = decode_client_message(encode(ClientMessage(hello)));
  EXPECT_EQ(refused.error().code, ErrorCode::LimitExceeded);
  EXPECT_THAT(refused.error().to_string(), testing::Not(HasSubstr("ttt")));  // tokens are never printed
  SetParameter parameter{std::string(kMaxAssignmentBytes, 'a')};
  EXPECT_TRUE(decode_client_message(encode(ClientMessage(parameter))));
  parameter.assignment += 'a';
  EXPECT_EQ(decode_client_message(encode(ClientMessage(parameter))).error().code, ErrorCode::LimitExceeded);
  EXPECT_FALSE(decode_client_message(encode(ClientMessage(SetParameter{"a\nb"}))));
}

TEST(ClockOffset, SymmetricPathsGiveTheExactOffset) {
  for (const int64_t truth_ns : {int64_t{0}, int64_t{-3'600'000} * kMsInNs, int64_t{7} * kMsInNs}) {
    ClockOffset clock;
    EXPECT_FALSE(clock.has_value());
    clock.add(100 * kMsInNs, 105 * kMsInNs + truth_ns, 108 * kMsInNs + truth_ns, 113 * kMsInNs);
    ASSERT_TRUE(clock.has_value());
    EXPECT_EQ(clock.offset_ns(), truth_ns);
    EXPECT_EQ(clock.error_ns(), 5 * kMsInNs);
    EXPECT_EQ(clock.to_server_ns(1), truth_ns + 1);
  }
}

TEST(ClockOffset, ErrorStaysBelowHalfTheBestRoundTripForAnyDelays) {
  std::mt19937_64 random(9);
  for (int trial = 0; trial < 200; ++trial) {
    const auto truth_ns = static_cast<int64_t>(random() % 1'000'000'000'000);
    ClockOffset clock;
    for (int probe = 0; probe < 20; ++probe) {
      const auto there_ns = static_cast<int64_t>(random() % (50 * kMsInNs));
      const auto held_ns = static_cast<int64_t>(random() % kMsInNs);
      const auto back_ns = static_cast<int64_t>(random() % (50 * kMsInNs));
      const int64_t send_ns = probe * 100 * kMsInNs;
      clock.add(send_ns, send_ns + there_ns + truth_ns, send_ns + there_ns + held_ns + truth_ns,
                send_ns + there_ns + held_ns + back_ns);
      EXPECT_LE(std::abs(clock.offset_ns() - truth_ns), clock.error_ns());
    }
  }
}

TEST(ClockOffset, KeepsTheBestProbeOfTheWindowOnly) {
  ClockOffset clock;
  clock.add(0, 1, 1, 2);  // excellent, but soon out of date
  for (size_t i = 0; i + 1 < kClockWindow; ++i) clock.add(0, 50 * kMsInNs, 50 * kMsInNs, 90 * kMsInNs);
  EXPECT_EQ(clock.error_ns(), 1);
  clock.add(0, 50 * kMsInNs, 50 * kMsInNs, 90 * kMsInNs);
  EXPECT_EQ(clock.error_ns(), 45 * kMsInNs);
}

TEST(ClockOffset, IgnoresImpossibleProbes) {
  ClockOffset clock;
  clock.add(10, 0, 0, 5);                 // received before sent
  clock.add(0, 5, 4, 10);                 // server runs backwards
  clock.add(0, 0, 20, 10);                // held longer than the round trip
  clock.add(0, 0, 0, 10'000'000'001);     // above 10 s
  clock.add(INT64_MIN, 0, 0, INT64_MAX);  // does not fit
  clock.add(0, INT64_MIN, INT64_MAX, 10);
  clock.add(INT64_MAX - 1, INT64_MIN, INT64_MIN, INT64_MAX);
  clock.add(0, INT64_MAX, INT64_MAX, 2);  // fits, but sums with it would not
  clock.add(0, kMaxClockNs + 1, kMaxClockNs + 1, 2);
  EXPECT_FALSE(clock.has_value());
  clock.add(0, kMaxClockNs, kMaxClockNs, 2);
  EXPECT_TRUE(clock.has_value());
}

}  // namespace
}  // namespace strandcast::wire_messages_test
