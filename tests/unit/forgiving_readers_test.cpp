// Every reader of text forgives the same defects: it bridges them or leaves an item out, and says how many
// and where the first is.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <functional>
#include <string>
#include <vector>

#include "common/groom/groom_file.h"
#include "common/groom/mesh.h"
#include "common/motion/bvh.h"
#include "common/motion/wind_csv.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::forgiving_readers_test {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr int kItems = 40, kMarkedItem = 21;
constexpr const char* kMarked = "7.25";  // a number of one item alone

/// What a reader made of a text.
struct Reading {
  std::string error;  // empty where it came in
  std::vector<float> numbers;
  std::vector<std::string> notes;
};

struct Reader {
  const char* name;
  const char* part;  // between numbers
  std::string text;
  std::function<Reading(const std::string& text)> read;
  const char* said;  // of one bad item
};

template <class T, class Numbers>
Reading reading(const Result<T>& result, std::vector<std::string> T::*notes, const Numbers& numbers) {
  if (!result) return {result.error().to_string(), {}, {}};
  Reading made;
  made.notes = (*result).*notes;
  for (const auto& point : numbers(*result))
    for (int axis = 0; axis < 3; ++axis) made.numbers.push_back(static_cast<float>(point[axis]));
  return made;
}
std::string point(int item, int vertex) {
  const bool is_marked = item == kMarkedItem && vertex == 1;
  return fmt::format("{}.5 {} {}.125", item, is_marked ? kMarked : "0.75", vertex);
}

std::string tfx() {
  std::string text = fmt::format("version 2.0\nnumStrands {}\nis sorted\n", kItems);
  for (int item = 0; item < kItems; ++item) {
    text += fmt::format("strand {} numVerts 3 texcoord 0.5 0.5\n", item);
    for (int vertex = 0; vertex < 3; ++vertex) text += point(item, vertex) + "\n";
  }
  return text;
}

std::string ply() {
  std::string text = fmt::format(
      "ply\nformat ascii 1.0\ncomment strand_vertex_count 3\nelement vertex {}\nproperty float x\n"
      "property float y\nproperty float z\nend_header\n",
      3 * kItems);
  for (int item = 0; item < kItems; ++item)
    for (int vertex = 0; vertex < 3; ++vertex) text += point(item, vertex) + "\n";
  return text;
}

std::string usda() {
  std::string counts, points;
  for (int item = 0; item < kItems; ++item) {
    counts += item == 0 ? "3" : ", 3";
    for (int vertex = 0; vertex < 3; ++vertex) {
      std::string numbers = point(item, vertex);
      for (size_t at = 0; (at = numbers.find(' ', at)) != std::string::npos; at += 2) numbers.insert(at, ",");
      points += (points.empty() ? "(" : ",\n(") + numbers + ")";
    }
  }
  return "#usda 1.0\n(\n  upAxis = \"Y\"\n  metersPerUnit = 0.01\n)\ndef BasisCurves \"hair\"\n{\n"
         "  uniform token type = \"linear\"\n  int[] curveVertexCounts = [" +
         counts + "]\n  point3f[] points = [" + points + "]\n}\n";
}

std::string obj() {
  std::string text;
  for (int item = 0; item < kItems; ++item) text += "v " + point(item, 1) + "\n";
  // The marked vertex is of no face: what is left out costs no other line.
  for (int item = 0; item + 2 < kMarkedItem; ++item)
    text += fmt::format("f {} {} {}\n", item + 1, item + 2, item + 3);
  return text;
}

std::string bvh() {
  std::string text =
      "HIERARCHY\nROOT Hips\n{\nOFFSET 0.0 0.0 0.0\nCHANNELS 6 Xposition Yposition Zposition Zrotation "
      "Xrotation "
      "Yrotation\nJOINT Head\n{\nOFFSET 0.0 60.5 0.0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\n"
      "OFFSET 0.0 20.5 0.0\n}\n}\n}\nMOTION\n" +
      fmt::format("Frames: {}\nFrame Time: 0.02\n", kItems);
  for (int item = 0; item < kItems; ++item)
    text += fmt::format("{} 0.5 5.5 0.5 1.5 2.5 3.5\n", point(item, 1));
  return text;
}

std::string wind() {
  std::string text = "t_s;x_mps;y_mps;z_mps\n";
  for (int item = 0; item < kItems; ++item) {
    std::string numbers = point(item, 1);
    std::replace(numbers.begin(), numbers.end(), ' ', ';');
    text += numbers + ";0.5\n";
  }
  return text;
}

/// As a scene takes it: nothing of it is guessed.
std::function<Reading(const std::string&)> groom_reader(const char* name) {
  return [name](const std::string& text) {
    const TemporaryFolder folder;
    GroomFileOptions options;
    options.path = folder.write(name, text);
    options.unit_m = 1.0f;
    options.is_z_up = false;
    options.yaw_deg = 0.0f;
    options.origin = glm::vec3(0.0f);
    Reading made = reading(load_placed_groom(options), &PlacedGroom::notes,
                           [](const PlacedGroom& it) { return it.groom.rest_position_m; });
    if (!made.notes.empty()) made.notes.pop_back();  // counts and size
    return made;
  };
}

Reading read_mesh(const std::string& text) {
  return reading(parse_obj(text, "a.obj", 1.0f), &ObjMesh::notes,
                 [](const ObjMesh& it) { return it.position_m; });
}

Reading read_motion(const std::string& text) {
  BvhOptions options;
  options.unit_m = 0.01;
  return reading(parse_bvh(text, "a.bvh", options), &MotionClip::repairs, [](const MotionClip& it) {
    std::vector<glm::dvec3> places;
    for (const Pose& pose : it.world_from_head) places.push_back(pose.position_m);
    return places;
  });
}

Reading read_wind(const std::string& text) {
  Reading made = reading(parse_wind_csv(text, "a.csv"), &WindSeries::repairs,
                         [](const WindSeries& it) { return it.velocity_mps; });
  if (!made.notes.empty()) made.notes.erase(made.notes.begin());  // semicolons
  return made;
}

std::vector<Reader> readers() {
  return {{"tfx", " ", tfx(), groom_reader("a.tfx"), "1 of 40 strands"},
          {"ply", " ", ply(), groom_reader("a.ply"), "1 of 40 strands"},
          {"usda", ", ", usda(), groom_reader("a.usda"), "1 of 40 strands"},
          {"obj", " ", obj(), read_mesh, "1 of 59 lines"},
          {"bvh", " ", bvh(), read_motion, "1 of 40 frames"},
          {"wind", ";", wind(), read_wind, "1 of 40 rows"}};
}

std::string replaced(std::string text, const std::string& from, const std::string& to, size_t begin = 0) {
  for (size_t at = begin; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

TEST(ForgivingReaders, LineEndsMarksAndTabsAreNoMatter) {
  for (const Reader& reader : readers()) {
    const Reading right = reader.read(reader.text);
    ASSERT_EQ(right.error, "") << reader.name;
    ASSERT_FALSE(right.numbers.empty()) << reader.name;
    EXPECT_THAT(right.notes, IsEmpty()) << reader.name;
    const size_t second_line = reader.text.find('\n') + 1;
    for (const auto& [defect, text] : {std::pair("CR", replaced(reader.text, "\n", "\r")),
                                       {"CRLF", replaced(reader.text, "\n", "\r\n")},
                                       {"mark", "\xef\xbb\xbf" + reader.text},
                                       {"tabs", replaced(reader.text, " ", "\t", second_line)},
                                       {"blanks behind", replaced(reader.text, "\n", " \n")}}) {
      const Reading found = reader.read(text);
      EXPECT_EQ(found.error, "") << reader.name << " " << defect;
      EXPECT_EQ(found.numbers, right.numbers) << reader.name << " " << defect;
      EXPECT_THAT(found.notes, IsEmpty()) << reader.name << " " << defect;
    }
  }
}

TEST(ForgivingReaders, DecimalCommasAreReadAndSaid) {
  for (const Reader& reader : readers()) {
    const Reading right = reader.read(reader.text);
    std::string all = reader.text;
    for (size_t at = all.find(".5"); at != std::string::npos; at = all.find_first_of('.', at + 1))
      if (std::isdigit(static_cast<unsigned char>(all[at + 1])) != 0) all[at] = ',';
    for (const std::string& text : {replaced(reader.text, kMarked, "7,25"), all}) {
      const Reading found = reader.read(text);
      EXPECT_EQ(found.error, "") << reader.name;
      EXPECT_EQ(found.numbers, right.numbers) << reader.name;
      EXPECT_THAT(found.notes, ElementsAre(HasSubstr("decimal comma"))) << reader.name;
    }
  }
}

TEST(ForgivingReaders, WhatIsNoNumberCostsItsItemWhichIsNamed) {
  for (const Reader& reader : readers()) {
    const Reading right = reader.read(reader.text);
    const std::string marked = kMarked, part = reader.part;
    for (const auto& [defect, instead] : {std::pair("nan", std::string("nan")),
                                          {"a C library's", "-1.#IND"},
                                          {"none", "abc"},
                                          {"infinite", "inf"},
                                          {"too large", "1e300"},
                                          {"too many", marked + part + marked},
                                          {"too few", ""}}) {
      const bool is_few = instead.empty();
      const Reading found = reader.read(replaced(reader.text, is_few ? marked + part : marked, instead));
      EXPECT_EQ(found.error, "") << reader.name << " " << defect;
      // Words of a .ply follow each other, whatever their lines; of a mesh more may follow a vertex.
      const bool is_count = is_few || std::string_view(defect) == "too many";
      if (is_count && std::string_view(reader.name) == "ply") {
        EXPECT_THAT(found.notes, Contains(HasSubstr(is_few ? "the file is cut off" : "after the last row")));
      } else if (is_count && !is_few && std::string_view(reader.name) == "obj") {
        EXPECT_THAT(found.notes, IsEmpty());
      } else {
        EXPECT_THAT(found.notes, ElementsAre(AllOf(HasSubstr(reader.said), HasSubstr("cannot be used"),
                                                   HasSubstr("the first:"))))
            << reader.name << " " << defect;
      }
      EXPECT_NE(found.numbers, right.numbers) << reader.name << " " << defect;
    }
  }
}

TEST(ForgivingReaders, ANumberOfItemsThatIsNotTheirsIsSaid) {
  struct Case {
    const char* name;
    std::string announced, more, fewer;
    const char *said_more, *said_fewer;
  };
  for (const Case& item :
       {Case{"tfx", "numStrands 40", "numStrands 42", "numStrands 38", "the file ends after 40 of 42 strands",
             "38 strands are announced, 40 are there"},
        {"ply", "vertex 120", "vertex 123", "vertex 117", "the file is cut off", "after the last row"},
        {"usda", "[3, 3", "[3, 3, 3", "[3", "need 123 points, there are 120",
         "need 117 points, there are 120"},
        {"bvh", "Frames: 40", "Frames: 42", "Frames: 38", "42 frames are announced, 40 are there",
         "38 frames are announced, 40 are there"}}) {
    const std::vector<Reader> all = readers();
    const auto reader = std::find_if(all.begin(), all.end(),
                                     [&](const Reader& it) { return it.name == std::string(item.name); });
    const Reading right = reader->read(reader->text);
    for (const auto& [instead, said] :
         {std::pair(item.more, item.said_more), {item.fewer, item.said_fewer}}) {
      const Reading found = reader->read(replaced(reader->text, item.announced, instead));
      EXPECT_EQ(found.error, "") << item.name << " " << instead;
      EXPECT_THAT(found.notes, Contains(HasSubstr(said))) << item.name;
      const size_t count = std::min(found.numbers.size(), right.numbers.size());
      EXPECT_GE(count + 9, right.numbers.size()) << item.name << " " << instead;
      EXPECT_TRUE(std::equal(right.numbers.begin(), right.numbers.begin() + static_cast<ptrdiff_t>(count),
                             found.numbers.begin()))
          << item.name << " " << instead;
    }
  }
}

}  // namespace
}  // namespace strandcast::forgiving_readers_test
