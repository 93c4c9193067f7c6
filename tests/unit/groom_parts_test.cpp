// What roots say of a groom's files: fur and beards are no hair of a head, parts may be in other units,
// strands may run from tip to root, and a head's mesh may be another's.
#include "common/groom/groom_parts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>

#include "common/base/file.h"
#include "common/groom/groom_file.h"
#include "common/groom/head_fit.h"
#include "common/groom/mesh_fit.h"
#include "common/groom/procedural.h"
#include "common/groom/tip_first.h"
#include "tests/support/groom_files.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::groom_parts_test {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr float kHeadM = 0.1f;  // radius
using Strand = std::vector<glm::vec3>;

/// Strands of six points that leave a ball where `grows` says so and fall from there, by their own lengths;
/// `middle_m` is the ball's.
std::vector<Strand> hair(const std::function<bool(const glm::vec3& out)>& grows, float length_m = 0.25f,
                         const glm::vec3& middle_m = {}, int root_count = 700) {
  std::vector<Strand> strands;
  for (int i = 0; i < root_count; ++i) {
    const double y = 1.0 - (2.0 * i + 1.0) / root_count, around = 2.399963 * i,
                 across = std::sqrt(1.0 - y * y);
    const glm::vec3 out(glm::dvec3(across * std::sin(around), y, across * std::cos(around)));
    if (!grows(out)) continue;
    Strand& strand = strands.emplace_back();
    const float own_m = length_m * (0.4f + 0.6f * static_cast<float>(i % 11) / 10.0f);
    for (int k = 0; k < 6; ++k) {
      const float down = std::max(static_cast<float>(k) - 1.0f, 0.0f) / 5.0f;
      const float off = static_cast<float>(std::min(k, 1)) / 5.0f;
      strand.push_back(middle_m + kHeadM * out + own_m * (off * out - glm::vec3(0.0f, down, 0.0f)));
    }
  }
  return strands;
}
bool is_of_scalp(const glm::vec3& out) {
  return out.y > 0.2f || (out.z < 0.2f && out.y > -0.5f);
}
bool is_of_jaw(const glm::vec3& out) {
  return out.y < -0.05f && out.y > -0.9f && out.z > 0.0f;
}

/// Writes strands in a unit; `said` is a comment line for it, or none.
std::filesystem::path write(const TemporaryFolder& folder, const std::string& name,
                            const std::vector<Strand>& strands, float unit_m, const std::string& said = "") {
  size_t points = 0;
  for (const Strand& strand : strands) points += strand.size();
  std::string text = "ply\nformat ascii 1.0\n" + said +
                     fmt::format(
                         "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
                         "element strand {}\nproperty int nverts\nend_header\n",
                         points, strands.size());
  for (const Strand& strand : strands)
    for (const glm::vec3& p : strand)
      text += fmt::format("{} {} {}\n", p.x / unit_m, p.y / unit_m, p.z / unit_m);
  for (const Strand& strand : strands) text += fmt::format("{}\n", strand.size());
  return folder.write(name, text);
}

PlacedGroom placed(const std::vector<std::filesystem::path>& paths, float unit_m = 0.0f) {
  GroomFileOptions options;
  options.path = paths.front();
  options.more_paths.assign(paths.begin() + 1, paths.end());
  options.unit_m = unit_m;
  options.is_z_up.reset();
  options.yaw_deg.reset();
  auto loaded = load_placed_groom(options);
  EXPECT_TRUE(loaded) << loaded.error().to_string();
  return loaded ? std::move(*loaded) : PlacedGroom{};
}

TEST(FurAndBeards, ABeardIsNoHairOfAHeadAndKeepsTheUnitThatIsStated) {
  const TemporaryFolder folder;
  const std::vector<Strand> beard = hair(is_of_jaw, 0.08f);
  for (const char* const said : {"comment unit_m 1\n", "comment unit_m 0.01\n"}) {
    const PlacedGroom found =
        placed({write(folder, "beard.ply", beard, said[15] == '1' ? 1.0f : 0.01f, said)});
    EXPECT_FALSE(found.is_of_head);
    EXPECT_EQ(found.unlikely, "");
    EXPECT_EQ(found.placement.yaw_deg, 0.0f) << "the face is where it grows";
    EXPECT_THAT(found.notes, Contains(HasSubstr("it is taken as a beard")));
  }
  EXPECT_EQ(placed({write(folder, "cm.ply", beard, 0.01f)}).placement.unit_m, 0.01f) << "a face of a person";
  EXPECT_TRUE(placed({write(folder, "hair.ply", hair(is_of_scalp), 1.0f)}).is_of_head);
  const auto wreath =
      hair([](const glm::vec3& out) { return out.z < 0.3f && out.y < 0.25f && out.y > -0.5f; });
  EXPECT_TRUE(placed({write(folder, "wreath.ply", wreath, 1.0f)}).is_of_head) << "about a bald top";
}

bool is_under_hairline(const glm::vec3& out) {
  return out.y > (out.z > 0.4f ? 0.55f : 0.55f - 1.1f * std::min(1.0f, (0.4f - out.z) / 0.8f));
}
bool is_of_brows(const glm::vec3& out) {
  return std::abs(out.y - 0.27f) < 0.05f && std::abs(std::abs(out.x) - 0.35f) < 0.2f && out.z > 0.0f;
}

TEST(FurAndBeards, AHeadIsTheSameWithABeardAndBrows) {
  const TemporaryFolder folder;
  const auto is_of_cheeks = [](const glm::vec3& out) {
    return out.y > -0.85f && out.y < -0.15f - 0.1f * out.z && out.z > 0.1f;
  };
  const glm::vec3 middle_m(0.0f, 1.6f, 0.0f);
  const auto whole = write(folder, "hair.ply", hair(is_under_hairline, 0.25f, middle_m), 1.0f);
  const auto beard = write(folder, "beard.ply", hair(is_of_cheeks, 0.06f, middle_m), 1.0f);
  const auto brows = write(folder, "brows.ply", hair(is_of_brows, 0.01f, middle_m, 9000), 1.0f);
  const auto crown = write(folder, "crown.ply",
                           hair([](const glm::vec3& out) { return out.y > 0.75f; }, 0.05f, middle_m), 1.0f);
  for (const std::vector<std::filesystem::path>& paths :
       {std::vector{whole, beard}, std::vector{beard, brows, whole}, std::vector{crown, beard, brows}}) {
    const PlacedGroom found = placed(paths);
    EXPECT_TRUE(found.is_of_head) << paths.front();
    EXPECT_EQ(found.placement.yaw_deg, 0.0f) << paths.front();
    EXPECT_EQ(found.placement.unit_m, 1.0f);
    const FittedSphere head = fit_head(found.groom);
    EXPECT_LT(glm::distance(head.center_m, middle_m), 1e-3f);
    EXPECT_NEAR(head.radius_m, kHeadM, 1e-3f);
  }
}

// Few places on one side of a head do not say that this side is up, or that the face is at the other one.
TEST(FurAndBeards, BrowsAndAMoustacheStayWhereTheyAre) {
  const TemporaryFolder folder;
  const auto moustache = [](const glm::vec3& out) { return out.y < -0.2f && out.y > -0.4f && out.z > 0.85f; };
  const auto both = [&](const glm::vec3& out) { return is_of_brows(out) || is_of_jaw(out); };
  for (const auto& [what, strands] : {std::pair("brows", hair(is_of_brows, 0.01f, {}, 9000)),
                                      {"a moustache", hair(moustache, 0.02f, {}, 9000)},
                                      {"brows and a beard", hair(both, 0.03f, {}, 9000)}}) {
    for (const float unit_m : {1.0f, 0.01f}) {
      const PlacedGroom found = placed({write(folder, "piece.ply", strands, unit_m)});
      EXPECT_EQ(found.placement.yaw_deg, 0.0f) << what;
      EXPECT_FALSE(found.placement.is_z_up || found.placement.is_upside_down) << what;
      EXPECT_EQ(found.placement.unit_m, unit_m) << what;
      EXPECT_THAT(found.notes, Contains(HasSubstr("it is taken as brows or a part of hair"))) << what;
    }
  }
}

TEST(FurAndBeards, FurOfABodyNeverGetsAHeadsUnit) {
  const TemporaryFolder folder;
  std::vector<Strand> fur;
  for (int i = 0; i < 900; ++i) {
    // Around a trunk of 1.5 m.
    const double y = 1.0 - (2.0 * i + 1.0) / 900.0, around = 2.399963 * i, across = std::sqrt(1.0 - y * y);
    const glm::vec3 out(glm::dvec3(across * std::sin(around), y, 3.0 * across * std::cos(around)));
    fur.push_back({0.25f * out, 0.25f * out + 0.02f * glm::normalize(out), 0.25f * out + 0.04f * out});
  }
  for (const float unit_m : {1.0f, 0.01f, 0.001f}) {
    const PlacedGroom found = placed({write(folder, "bear.ply", fur, unit_m)});
    EXPECT_FALSE(found.is_of_head);
    EXPECT_EQ(found.placement.unit_m, unit_m);
    EXPECT_THAT(found.notes, Contains(HasSubstr("these roots are no head of hair")));
  }
  const PlacedGroom stated = placed({write(folder, "doll.ply", fur, 0.1f, "comment unit_m 0.1\n")});
  EXPECT_EQ(stated.placement.unit_m, 0.1f);
  EXPECT_EQ(stated.unlikely, "");
}

// As flat as a disc is, but its hair grows to all sides.
TEST(FurAndBeards, FurOfASlenderBodyKeepsTheUnitThatIsStated) {
  const TemporaryFolder folder;
  std::vector<Strand> fur;
  for (int i = 0; i < 400; ++i) {
    const glm::vec3 out(std::sin(2.399963f * static_cast<float>(i)), 0.0f,
                        std::cos(2.399963f * static_cast<float>(i)));
    const glm::vec3 root = 0.15f * out + glm::vec3(0.0f, 1.7f * static_cast<float>(i) / 400.0f, 0.0f);
    fur.push_back({root, root + 0.02f * out, root + 0.04f * out});
  }
  for (const char* const said : {"comment unit_m 1\n", ""}) {
    const PlacedGroom found = placed({write(folder, "fuzz.ply", fur, 1.0f, said)});
    EXPECT_FALSE(found.is_of_head);
    EXPECT_EQ(found.unlikely, "");
    EXPECT_EQ(found.placement.unit_m, 1.0f);
  }
}

TEST(GroomParts, AStrandWhoseRootStandsAloneIsLeftOut) {
  const TemporaryFolder folder;
  const std::vector<Strand> strands = hair(is_of_scalp);
  const auto count_with = [&](size_t moved, float off_m, const char* note) {
    std::vector<Strand> other = strands;
    for (size_t i = 0; i < moved; ++i)
      for (glm::vec3& point : other[40 + i]) point.x += off_m;
    const PlacedGroom found = placed({write(folder, "off.ply", other, 1.0f, "comment unit_m 1\n")});
    EXPECT_THAT(found.notes, Contains(HasSubstr(note)));
    EXPECT_TRUE(off_m < 0.7f || found.unlikely.empty()) << "the others say how large the head is";
    return found.groom.strand_count();
  };
  const auto all = static_cast<uint32_t>(strands.size());
  EXPECT_EQ(count_with(1, 0.8f, "1 of 4"), all - 1);
  EXPECT_EQ(count_with(1, 0.2f, "strands x 6"), all) << "beside the head";
  EXPECT_EQ(count_with(12, 0.6f, "strands x 6"), all) << "a patch, which is meant";
}

TEST(GroomParts, HairFarAwayOnItsStageIsBroughtHere) {
  const TemporaryFolder folder;
  GroomFileOptions options;
  options.path =
      write(folder, "far.ply", hair(is_of_scalp, 0.25f, {100.0f, 1.6f, -40.0f}), 1.0f, "comment unit_m 1\n");
  EXPECT_THAT(load_placed_groom(options).error().to_string(), HasSubstr("allowed is +-100 m"))
      << "where its origin is stated";
  options.origin.reset();
  const auto found = load_placed_groom(options);
  ASSERT_TRUE(found) << found.error().to_string();
  EXPECT_THAT(found->notes, Contains(HasSubstr("it stands 107.7 m from the origin, and is brought here")));
  for (const glm::vec3& root : roots_of(found->groom)) EXPECT_LT(glm::length(root), 2.0f * kHeadM);
  options.path = write(folder, "near.ply", hair(is_of_scalp, 0.25f, {1.0f, 1.6f, -4.0f}), 1.0f);
  EXPECT_EQ(load_placed_groom(options)->placement.origin, glm::vec3(0.0f));
}

TEST(GroomParts, AFileInAnotherUnitIsFoundByWhereItsRootsLie) {
  const TemporaryFolder folder;
  const auto front = [](const glm::vec3& out) { return is_of_scalp(out) && out.z > 0.1f; };
  const auto back = [&](const glm::vec3& out) { return is_of_scalp(out) && !front(out); };
  for (const glm::vec3& middle_m : {glm::vec3(0.0f), glm::vec3(0.0f, 1.6f, 0.0f)}) {
    const auto in_m = write(folder, "back.ply", hair(back, 0.25f, middle_m), 1.0f);
    const PlacedGroom alike = placed({in_m, write(folder, "front.ply", hair(front, 0.1f, middle_m), 1.0f)});
    EXPECT_THAT(alike.notes, Not(Contains(HasSubstr("is scaled by"))));
    const PlacedGroom other = placed({in_m, write(folder, "front.ply", hair(front, 0.1f, middle_m), 0.01f)});
    EXPECT_THAT(other.notes,
                Contains(AllOf(HasSubstr("front.ply is scaled by 0.01"), HasSubstr("back.ply"))));
    EXPECT_EQ(other.unlikely, "");
    ASSERT_EQ(other.groom.rest_position_m.size(), alike.groom.rest_position_m.size());
    float off_m = 0.0f;
    for (size_t i = 0; i < alike.groom.rest_position_m.size(); ++i)
      off_m = std::max(off_m, glm::distance(alike.groom.rest_position_m[i], other.groom.rest_position_m[i]));
    EXPECT_LT(off_m, 1e-4f);
  }
}

// A head of 88 mm that metres taken for centimetres have made small has that size again.
TEST(GroomParts, MetresThatWereTakenForCentimetresAreFound) {
  const TemporaryFolder folder;
  constexpr float kOtherHead = 0.88f;
  std::vector<Strand> strands = hair(is_of_scalp);
  for (Strand& strand : strands)
    for (glm::vec3& point : strand) point *= kOtherHead;
  const PlacedGroom found = placed({write(folder, "small.ply", strands, 100.0f)});
  EXPECT_EQ(found.placement.unit_m, 100.0f);
  EXPECT_THAT(found.notes, Contains(HasSubstr("in units of 100 m the head has the size of a person's")));
}

TEST(GroomParts, UnitsThatFilesStateAreBroughtTogether) {
  const TemporaryFolder folder;
  const auto m = write(folder, "m.ply", hair(is_of_scalp), 1.0f, "comment unit_m 1\n");
  const auto cm = write(folder, "cm.ply", hair(is_of_jaw, 0.08f), 0.01f, "comment unit_m 0.01\n");
  const auto bare = write(folder, "bare.ply", hair(is_of_jaw, 0.08f), 0.01f);
  for (const std::vector<std::filesystem::path>& paths :
       {std::vector{m, cm}, std::vector{cm, m}, std::vector{m, bare}, std::vector{bare, m}}) {
    const PlacedGroom found = placed(paths);
    EXPECT_THAT(found.notes, Contains(HasSubstr("scaled by"))) << paths.front();
    for (const glm::vec3& root : roots_of(found.groom)) EXPECT_NEAR(glm::length(root), kHeadM, 1e-3f);
  }
}

TEST(GroomParts, RootsOnNoneOfTheOthersHeadFailTheCheck) {
  const TemporaryFolder folder;
  const auto here = write(folder, "here.ply", hair(is_of_scalp), 1.0f);
  const auto there = write(folder, "there.ply", hair(is_of_jaw, 0.1f, {5.0f, 3.0f, -4.0f}), 1.0f);
  EXPECT_THAT(placed({here, there}).unlikely,
              AllOf(HasSubstr("the roots of"), HasSubstr("there.ply are not on the head of")));
}

TEST(TipFirst, StrandsThatRunFromTipToRootAreTurnedRound) {
  const TemporaryFolder folder;
  std::vector<Strand> strands = hair(is_of_scalp);
  const PlacedGroom right = placed({write(folder, "right.ply", strands, 1.0f)});
  EXPECT_THAT(right.notes, Not(Contains(HasSubstr("from tip to root"))));
  // A bob: all tips at one height, on a ring that a ball fits.
  std::vector<Strand> bob = strands;
  for (Strand& strand : bob)
    for (size_t k = 2; k < strand.size(); ++k) {
      const float share = static_cast<float>(k - 1) / static_cast<float>(strand.size() - 2);
      strand[k] = strand[1] - glm::vec3(0.0f, share * (strand[1].y + 0.2f), 0.0f);
    }
  const PlacedGroom short_hair = placed({write(folder, "bob.ply", bob, 1.0f)});
  EXPECT_THAT(short_hair.notes, Not(Contains(HasSubstr("from tip to root"))));
  for (Strand& strand : strands) std::reverse(strand.begin(), strand.end());
  for (Strand& strand : bob) std::reverse(strand.begin(), strand.end());
  const PlacedGroom turned = placed({write(folder, "turned.ply", strands, 1.0f)});
  EXPECT_THAT(turned.notes, Contains(HasSubstr("its strands run from tip to root and are turned round")));
  EXPECT_EQ(turned.groom.rest_position_m, right.groom.rest_position_m);
  EXPECT_EQ(turned.groom.pinned, right.groom.pinned);
  const PlacedGroom turned_bob = placed({write(folder, "turned_bob.ply", bob, 1.0f)});
  EXPECT_EQ(turned_bob.groom.rest_position_m, short_hair.groom.rest_position_m);
}

/// A groom of these strands in metres, as a file gives it.
Groom groom_of(const std::vector<Strand>& strands) {
  const TemporaryFolder folder;
  return placed({write(folder, "hair.ply", strands, 1.0f)}).groom;
}

void turn(Groom& groom, uint32_t strand) {
  std::reverse(groom.rest_position_m.begin() + groom.offset[strand],
               groom.rest_position_m.begin() + groom.offset[strand + 1]);
}

TEST(TipFirst, StrandsAgainstTheOthersBesideThemAreTurnedRound) {
  std::vector<Strand> afro = hair(is_of_scalp);
  std::vector<Strand> slicked = hair([](const glm::vec3& out) { return is_of_scalp(out) && out.z > -0.4f; });
  for (Strand& strand : slicked) {
    // Over the head, along it.
    glm::vec3 out = glm::normalize(strand[0]);
    for (glm::vec3& point : strand) {
      point = kHeadM * out;
      out = glm::normalize(out + glm::vec3(0.0f, -0.1f, -0.22f));
    }
  }
  for (Strand& strand : afro)
    for (size_t k = 1; k < strand.size(); ++k) strand[k] = (1.0f + 0.35f * static_cast<float>(k)) * strand[0];
  struct Case {
    const char* what;
    Groom groom;
    bool is_told;  // which end is the root
  };
  std::vector<Case> cases;
  cases.push_back({"long", groom_of(hair(is_of_scalp)), true});
  cases.push_back({"slicked", groom_of(slicked), false});
  cases.push_back({"afro", groom_of(afro), false});
  for (const Case& item : cases) {
    const uint32_t all = item.groom.strand_count();
    struct Mixed {
      const char* what;
      std::function<bool(uint32_t)> is_turned;
      bool are_few;
    };
    for (const Mixed& mixed : {Mixed{"one in ten", [](uint32_t i) { return i % 10 == 3; }, true},
                               Mixed{"every other one", [](uint32_t i) { return i % 2 == 0; }, false},
                               Mixed{"most", [](uint32_t i) { return i % 4 != 0; }, false},
                               Mixed{"one half", [&](uint32_t i) { return i > all / 2; }, false}}) {
      Groom groom = item.groom;
      uint32_t count = 0;
      for (uint32_t i = 0; i < all; ++i) {
        if (!mixed.is_turned(i)) continue;
        ++count;
        turn(groom, i);
      }
      const std::vector<glm::vec3> before = groom.rest_position_m;
      StrandLabels labels;
      const std::string said = turn_tips_first(groom, labels);
      if (item.is_told || mixed.are_few) {
        EXPECT_THAT(said, HasSubstr(fmt::format("{} of its {} strands run from tip to root", count, all)))
            << item.what << " " << mixed.what;
        EXPECT_TRUE(groom.rest_position_m == item.groom.rest_position_m) << item.what << " " << mixed.what;
      } else {
        EXPECT_EQ(said, "") << item.what << " " << mixed.what;
        EXPECT_TRUE(groom.rest_position_m == before) << item.what << " " << mixed.what;
      }
    }
  }
}

TEST(TipFirst, HairThatIsGrownIsRight) {
  for (const float length_m : {0.01f, 0.03f, 0.1f, 0.28f, 0.9f}) {
    for (const float curl_m : {0.0f, 0.02f}) {
      ProceduralGroomOptions options;
      options.length_m = length_m;
      options.curl_radius_m = curl_m;
      Groom groom = grow_groom(make_scalp_cap(glm::vec3(0.0f), kHeadM, 2000), options).value();
      const std::vector<glm::vec3> points = groom.rest_position_m;
      StrandLabels labels;
      EXPECT_EQ(turn_tips_first(groom, labels), "") << length_m << " m, curls of " << curl_m;
      EXPECT_EQ(groom.rest_position_m, points);
    }
  }
}

TEST(TipFirst, NoRealGroomIsTurnedRoundAndHeadsAreFoundWhenTheyAre) {
  REQUIRE_SHARED_DATA();
  for (const char* const name : {"sintel_11400x16.tfx", "Ratboy_mohawk.tfx", "TestHair1.tfx",
                                 "ponytail_front_top.tfx", "ponytail_side.tfx"}) {
    GroomFileOptions options;
    options.path = test::shared_data() / "grooms" / name;
    Groom groom = load_groom(options).value();
    StrandLabels labels;
    EXPECT_EQ(turn_tips_first(groom, labels), "") << name;
    const std::vector<glm::vec3> points = groom.rest_position_m;
    const uint32_t count = groom.uniform_vertex_count();
    for (size_t i = 0; i < points.size(); i += count)
      std::reverse(groom.rest_position_m.begin() + static_cast<std::ptrdiff_t>(i),
                   groom.rest_position_m.begin() + static_cast<std::ptrdiff_t>(i + count));
    // Fur, and a line of hair, are alike at both ends.
    const bool is_told =
        std::string_view(name) != "TestHair1.tfx" && std::string_view(name) != "Ratboy_mohawk.tfx";
    EXPECT_EQ(turn_tips_first(groom, labels).empty(), !is_told) << name;
    EXPECT_EQ(groom.rest_position_m == points, is_told) << name;
  }
}

TEST(GroomParts, StrandsOfMorePointsThanAreSimulatedSaySo) {
  const TemporaryFolder folder;
  std::vector<Strand> strands = hair(is_of_scalp);
  for (Strand& strand : strands) {
    // A hundred points, most of them near the root.
    Strand fine;
    for (int k = 0; k < 100; ++k) {
      const float share = static_cast<float>(k * k) / (99.0f * 99.0f);
      fine.push_back(glm::mix(strand.front(), strand.back(), share));
    }
    strand = std::move(fine);
  }
  const auto path = write(folder, "fine.ply", strands, 1.0f);
  const PlacedGroom found = placed({path});
  ASSERT_EQ(found.groom.uniform_vertex_count(), kMaxVertexCount);
  EXPECT_THAT(found.notes, Contains(HasSubstr("strands of up to 100 points are resampled to 64 each")));
  const Groom& groom = found.groom;
  for (uint32_t strand = 0; strand < groom.strand_count(); strand += 50) {
    const float step_m = groom.length_m(strand) / 63.0f;
    EXPECT_NEAR(groom.length_m(strand), glm::distance(strands[strand].front(), strands[strand].back()),
                1e-4f);
    for (uint32_t i = groom.offset[strand]; i + 1 < groom.offset[strand + 1]; ++i)
      EXPECT_NEAR(glm::distance(groom.rest_position_m[i], groom.rest_position_m[i + 1]), step_m, 1e-5f);
  }
  GroomFileOptions options;
  options.path = path;
  options.vertex_count = 16;
  EXPECT_THAT(load_placed_groom(options).value().notes, Not(Contains(HasSubstr("resampled")))) << "as asked";
}

// As a simple program makes it, with all strands of one length: nothing says which end is which.
TEST(TipFirst, HairThatFallsStraightDownIsLeftAsItIs) {
  const TemporaryFolder folder;
  std::vector<Strand> strands = hair([](const glm::vec3& out) { return out.y > 0.1f; });
  for (Strand& strand : strands)
    for (size_t k = 1; k < strand.size(); ++k)
      strand[k] = strand[0] - glm::vec3(0.0f, 0.05f * static_cast<float>(k), 0.0f);
  const PlacedGroom found = placed({write(folder, "down.ply", strands, 1.0f)});
  EXPECT_THAT(found.notes, Not(Contains(HasSubstr("from tip to root"))));
}

// Few guides leave 20 degrees between roots, where they happen to be.
TEST(GroomParts, FewGuidesOfASymmetricHeadFaceAhead) {
  const TemporaryFolder folder;
  for (uint32_t seed = 1; seed <= 30; ++seed) {
    std::mt19937 random(seed);
    std::vector<Strand> strands;
    while (strands.size() < 70) {
      const auto number = [&] { return static_cast<float>(random()) / 2147483648.0f - 1.0f; };
      const glm::vec3 out(number(), number(), number());
      if (glm::length(out) > 1.0f || !is_of_scalp(glm::normalize(out))) continue;
      const glm::vec3 root = kHeadM * glm::normalize(out);
      strands.push_back({root, 1.3f * root, 1.3f * root - glm::vec3(0.0f, 0.1f, 0.0f)});
    }
    EXPECT_EQ(placed({write(folder, "few.ply", strands, 1.0f)}).placement.yaw_deg, 0.0f) << seed;
  }
}

/// A skull that is longer than wide, with a face: no turn of it is like it.
Mesh skull(const std::function<glm::vec3(const glm::vec3&)>& change) {
  Mesh mesh = make_head(kHeadM);
  for (glm::vec3& point : mesh.position_m) point = change(point);
  mesh.normal = compute_normals(mesh.position_m, mesh.triangle);
  return mesh;
}

TEST(HeadMesh, OneThatDoesNotFitItsHairIsTold) {
  const Mesh head = make_head(kHeadM);
  // Roots on its skin where hair grows.
  Groom groom;
  groom.offset = {0};
  for (const glm::vec3& point : head.position_m) {
    const bool is_scalp = (point.y > 0.05f || point.z < -0.03f) && point.y > -0.06f;
    if (!is_scalp) continue;
    groom.rest_position_m.insert(groom.rest_position_m.end(), {point, point - glm::vec3(0.0f, 0.2f, 0.0f)});
    groom.pinned.insert(groom.pinned.end(), {1, 0});
    groom.offset.push_back(static_cast<uint32_t>(groom.rest_position_m.size()));
  }
  ASSERT_GT(groom.strand_count(), 200u);
  const glm::vec3 origin_m(0.0f, -1.6f, 0.0f);  // between the feet
  const auto told = [&](const std::function<glm::vec3(const glm::vec3&)>& change) {
    return unfit_mesh(skull(change), groom, origin_m);
  };
  EXPECT_EQ(told([](const glm::vec3& p) { return p; }), "");
  EXPECT_EQ(told([](const glm::vec3& p) { return 0.97f * p; }), "") << "hair that stands off by 3 mm";
  const auto scaled = [&](float scale) {
    return told([&](const glm::vec3& p) { return origin_m + scale * (p - origin_m); });
  };
  EXPECT_THAT(scaled(0.1f), HasSubstr("if it is made 10 times as large"));
  EXPECT_THAT(scaled(10.0f), HasSubstr("if it is made 0.1 times as large"));
  EXPECT_THAT(scaled(100.0f), HasSubstr("if it is made 0.01 times as large"));
  const auto moved = [&](const glm::vec3& by_m) {
    return told([&](const glm::vec3& p) { return p + by_m; });
  };
  for (const glm::vec3& by_m : {glm::vec3(0.4f, 0.0f, 0.0f),
                                {0.0f, 0.0f, 0.03f},
                                {-0.03f, 0.0f, 0.0f},
                                {0.0f, 0.06f, 0.0f},
                                {0.02f, -1.5f, 0.0f}}) {
    const std::string text = moved(by_m);
    glm::vec3 back_mm;
    const size_t begin = std::min(text.find("moved by about ("), text.size());
    ASSERT_EQ(std::sscanf(text.c_str() + begin, "moved by about (%f, %f, %f) mm", &back_mm.x, &back_mm.y,
                          &back_mm.z),
              3)
        << by_m.x << " " << by_m.y << " " << by_m.z << text;
    EXPECT_LT(glm::distance(back_mm, -1000.0f * by_m), 8.0f) << text;
  }
  EXPECT_EQ(moved({0.0f, 0.01f, 0.0f}), "") << "as hair may stand off";
  EXPECT_THAT(told([](const glm::vec3& p) { return p.y > 0.0f ? 2.0f * p : 0.3f * p; }),
              HasSubstr("no usual turn, size or movement brings it there"))
      << "another's";
  EXPECT_THAT(told([](const glm::vec3& p) { return glm::vec3(-p.x, p.y, -p.z); }),
              HasSubstr("turned by 180 degrees about Y"));
  EXPECT_THAT(told([](const glm::vec3& p) { return glm::vec3(p.z, p.y, -p.x); }),
              HasSubstr("turned by -90 degrees about Y"));
  EXPECT_THAT(told([&](const glm::vec3& p) {
                const glm::vec3 off = p - origin_m;
                return origin_m + glm::vec3(off.x, -off.z, off.y);
              }),
              HasSubstr("turned by -90 degrees about X"));
}

TEST(HeadMesh, ARealOneFitsItsHair) {
  REQUIRE_SHARED_DATA();
  GroomFileOptions options;
  options.path = test::shared_data() / "grooms/sintel_11400x16.tfx";
  const Groom groom = load_groom(options).value();
  Mesh mesh = load_obj(test::shared_data() / "meshes/sintel.obj", 1.0f).value();
  EXPECT_EQ(unfit_mesh(mesh, groom, {}), "");
  for (glm::vec3& point : mesh.position_m) point = {-point.x, point.y, -point.z};
  EXPECT_THAT(unfit_mesh(mesh, groom, {}), HasSubstr("turned by 180 degrees about Y"));
}

// Small files that failed once, each with its right answer beside it.
TEST(CaseFiles, HairComesInAsItShould) {
  const std::filesystem::path folder = test::shared_data() / "cases";
  REQUIRE_SHARED(folder);
  const PlacedGroom short_curve = placed({folder / "one_vertex_curve.usda"});
  EXPECT_EQ(short_curve.groom.strand_count(), 22u) << "another curve has no length";
  EXPECT_THAT(short_curve.notes, Contains(HasSubstr("left out")));
  EXPECT_EQ(placed({folder / "upaxis_lowercase.usda"}).groom.strand_count(), 24u);
  EXPECT_THAT(placed({folder / "unit_lies.usda"}).unlikely,
              AllOf(HasSubstr("as on no head"), HasSubstr("groom.file.unit_m=1 ")));
}

}  // namespace
}  // namespace strandcast::groom_parts_test
