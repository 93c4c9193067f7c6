// First inputs for what mocap stages send.
#include <limits>

#include "tests/fuzz/seed_folder.h"
#include "tests/support/live_packets.h"

namespace strandcast {
namespace {

using Bytes = SeedBytes;

/// Steps of live_policy_fuzz: poses of a head that moves along x, a period apart each.
void add_live_poses(const SeedFolder& seeds) {
  constexpr uint8_t kTake = 3, kNumbered = 4, kTimed = 16, kAnyNumbers = 1;
  constexpr uint16_t kPeriod = 500;  // in 20 microseconds: 10 ms
  constexpr int16_t kOne = 1 << 13;
  const auto pose = [](int i, double x_m) {
    return packed(kPeriod, kTake, static_cast<uint8_t>(kNumbered | kTimed), static_cast<int16_t>(kOne * x_m),
                  int16_t{kOne}, int16_t{0}, kOne, int16_t{0}, int16_t{0}, int16_t{0},
                  static_cast<uint8_t>(i), static_cast<uint16_t>(10 * i));
  };
  const auto command = [](uint8_t step) { return packed(kPeriod, step); };
  Bytes order, jump, commands, numbers;
  for (int i = 0; i < 60; ++i) {
    const int sent = i % 10 == 4 ? i + 1 : i % 10 == 5 ? i - 1 : i;  // two change places
    if (i % 10 != 8) order = joined({order, pose(sent, 0.01 * sent)});
    jump = joined({jump, pose(i, i >= 20 && i < 40 ? 2.0 : 0.0)});
    commands =
        joined({commands, pose(i, 0.01 * i), i % 20 == 7 ? command(static_cast<uint8_t>(i / 20)) : Bytes{}});
  }
  for (const double number :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e308})
    numbers = joined({numbers, pose(0, 0.0),
                      packed(kPeriod, kTake, kAnyNumbers, number, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0),
                      packed(kPeriod, kTake, kAnyNumbers, 0.0, 0.0, 0.0, number, 0.0, 0.0, 0.0)});
  seeds.add("live_policy", "order", order);
  seeds.add("live_policy", "jump", jump);
  seeds.add("live_policy", "commands", commands);
  seeds.add("live_policy", "numbers", numbers);
}
/// Pieces as FuzzInput::take_piece has them.
Bytes pieces(std::initializer_list<Bytes> parts) {
  Bytes bytes;
  for (const Bytes& part : parts) bytes = joined({bytes, packed(static_cast<uint16_t>(part.size())), part});
  return bytes;
}

/// OSC that is right, and each kind of it that other readers are known to have broken on.
void add_live_osc(const SeedFolder& seeds) {
  using test::osc;
  using test::osc_bundle;
  const auto add = [&](const std::string& name, std::initializer_list<Bytes> datagrams) {
    seeds.add("live_osc", name, joined({packed(uint8_t{1}), pieces(datagrams)}));
  };
  const test::Quad turned = {0.1f, 0.2f, -0.3f, 0.9f};
  const Bytes head = test::vmc_head({0.1f, 1.5f, -0.2f}, turned, 1.5f);
  add("head", {head, test::vmc_head({0.2f, 1.5f, 0.1f}, {0, 0, 0, 1}, 1.6f), test::osc_wind({1, 2, 3})});
  std::vector<Bytes> bones;
  for (const char* name : {"Hips", "Spine", "Chest", "Neck", "Head", "LeftShoulder", "LeftUpperArm",
                           "LeftLowerArm", "RightShoulder", "RightUpperArm", "RightLowerArm", "UpperChest"})
    bones.push_back(test::vmc_bone(name, {0, 0, 0}, turned));
  add("bones", {osc_bundle(bones), osc_bundle({bones.back()}), osc_bundle(bones)});
  add("single",
      {bones[4], bones[0], bones[4], test::vmc_pose("/VMC/Ext/Tra/Pos", "LHR-1", {1, 2, 3}, turned)});
  add("no_direction", {osc_bundle({test::vmc_bone("Head", {NAN, 0, 0}, {0, 0, 0, 0})})});
  add("nested", {osc_bundle({osc_bundle({osc_bundle({osc_bundle({osc("/a", {1})})})})}),
                 osc_bundle({osc_bundle({osc_bundle({osc_bundle({osc_bundle({osc("/a", {1})})})})})})});
  add("padding", {osc("/abc", {std::string("four"), 1}), osc("/abcd", {std::string("eightlet"), 2})});
  const auto blob = [&](uint32_t size) {
    return test::PacketWriter(std::endian::big)
        .text(std::string("/b\0\0,b\0\0", 8))
        .put(size)
        .put(uint32_t{0})
        .bytes();
  };
  add("blob", {blob(4), blob(9), blob(0xffffffff), blob(0xfffffffd)});
  add("mark_without_nul", {bytes_of("#bundle!\1\1\1\1\1\1\1\1"), bytes_of("#bundle"), bytes_of("#")});
  Bytes wrong_size = head;
  wrong_size[16] = std::byte{0x7f};
  add("size_beyond", {wrong_size, Bytes(head.begin(), head.begin() + 40)});
  add("unknown", {osc("/VMC/Ext/Bone/Pos", {std::string("Head"), 1.0f}), osc("/VMC/Ext/T", {3}),
                  test::PacketWriter(std::endian::big).text(std::string("/q\0\0,Qf\0", 8)).bytes()});
}

/// The other live protocols: right packets, cut ones, wrong checksums, counts beyond all bounds.
void add_live_packets(const SeedFolder& seeds) {
  enum Protocol : uint8_t { kOpentrack, kFreed, kNatnet, kVrpn, kFace, kTrack, kMvn };
  const auto add = [&](Protocol protocol, uint8_t settings, const std::string& name,
                       std::initializer_list<Bytes> packets) {
    seeds.add("live_packet", name,
              joined({packed(static_cast<uint8_t>(protocol), settings), pieces(packets)}));
  };
  const auto with = [](Bytes bytes, size_t at, uint8_t value) {
    bytes[at] = std::byte{value};
    return bytes;
  };
  const auto cut = [](const Bytes& bytes, size_t left) {
    return Bytes(bytes.begin(), bytes.end() - static_cast<ptrdiff_t>(left));
  };
  const Bytes places = test::opentrack({1, 2, 3, 40, 50, 60});
  add(kOpentrack, 0, "opentrack", {places, cut(places, 1), test::opentrack({NAN, 0, 0, 1e308, 0, 0})});
  const Bytes camera = test::freed({2, {10, 20, 30}, {100, 200, 300}});
  add(kFreed, 1, "freed", {camera, with(camera, 28, 0), with(camera, 0, 0xD0), cut(camera, 1)});
  for (const std::string version : {"2.5", "2.9", "3.1", "4.0", "4.1"}) {
    test::NatnetPacket frame;
    frame.version = version;
    frame.bodies = {{2, {1, 2, 3}, {0, 0, 0, 1}, true}, {3, {1, 2, 3}, {0, 0, 0, 0}, false}};
    frame.bones = {{7, {1, 2, 3}, {0, 0, 0, 1}, true}};
    frame.has_all_kinds = true;
    const Bytes motion = test::natnet(frame);
    const Bytes names = test::natnet_names(version, {{2, "Head"}}, {{7, "Head"}});
    add(kNatnet, 0, "natnet_" + version,
        {test::natnet_server(4, 1), names, motion, cut(motion, 1), cut(names, 3),
         test::natnet_message(8, {})});
    add(kNatnet, 6, "natnet_counts_" + version,
        {with(motion, 8, 0xff), with(motion, 11, 0xff), with(motion, 15, 0xff), with(names, 7, 0xff)});
  }
  const Bytes begin = test::vrpn_begin("Head");
  const Bytes pose = test::vrpn_pose(1.5, 0, 3, 1, {1, 2, 3}, {0, 0, 0, 1});
  add(kVrpn, 0, "vrpn", {begin, pose, joined({pose, cut(pose, 5)})});
  add(kVrpn, 64, "vrpn_cut",
      {joined({begin, pose, test::vrpn_message(1, 0, 2, Bytes(3)), pose}), with(pose, 0, 0xff)});
  add(kVrpn, 1, "vrpn_names",
      {joined({begin, test::vrpn_description(-1, 9999, "far")}),
       joined({begin, test::vrpn_message(0, 1, -2, Bytes(6, std::byte{0x7f}))})});
  const Bytes face = test::live_link_face({});
  add(kFace, 0, "face", {face, cut(face, 245), cut(face, 1), with(face, 0, 7), with(face, 1, 0xff)});
  add(kFace, 1, "face_sized",
      {test::PacketWriter(std::endian::big).put(static_cast<uint32_t>(face.size())).append(face).bytes()});
  const Bytes body = test::mvn({});
  add(kMvn, 0, "mvn", {body, cut(body, 1), with(body, 5, '1'), with(body, 11, 0xff), with(body, 24, 0xff)});
  const std::string track =
      R"({"sourceNumber":1,"timing":{"sequenceNumber":2,"sampleRate":{"num":60,"denom":1}},"transforms":[)"
      R"({"translation":{"x":1,"y":2,"z":3},"rotation":{"pan":1,"tilt":2,"roll":3},"scale":{"x":1,"y":1,"z":1}}]})";
  const Bytes whole = test::opentrackio(track);
  const auto piece = [&](size_t at, size_t size) {
    return test::opentrackio(track.substr(at, size),
                             {.offset = static_cast<uint32_t>(at), .is_last = at + size >= track.size()});
  };
  add(kTrack, 0, "opentrackio", {whole, cut(whole, 1), with(whole, 14, 0), with(whole, 5, 0x80)});
  add(kTrack, 2, "opentrackio_segments",
      {piece(0, 50), piece(50, 50), piece(50, 50), piece(100, 50), piece(150, track.size() - 150)});
  const std::string cbor("\xBF\x6Atransforms\x9F\xA1\x68rotation\xA1\x63pan\xF9\x3E\x00\xFF\xFF", 33);
  add(kTrack, 2, "opentrackio_cbor",
      {test::opentrackio(cbor, {.encoding = 2}),
       test::opentrackio(std::string(60, '\x81'), {.encoding = 2})});
}

}  // namespace

void add_live_seeds(const SeedFolder& seeds) {
  add_live_poses(seeds);
  add_live_osc(seeds);
  add_live_packets(seeds);
}

}  // namespace strandcast
