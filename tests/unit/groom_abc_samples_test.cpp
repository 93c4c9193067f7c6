// The shared Alembic samples: all content as the library that wrote them had it, and of damaged ones a
// sentence or a sound groom.
#include <algorithm>
#include <cmath>
#include <set>

#include "client/export/abc_file.h"
#include "common/base/file.h"
#include "common/groom/abc_curves.h"
#include "common/groom/abc_loader.h"
#include "common/groom/abc_tree.h"
#include "tests/fuzz/groom_checks.h"
#include "tests/support/bounded_work.h"
#include "tests/support/groom_files.h"
#include "tests/support/json_value.h"
#include "tests/support/largest_allocation.h"

namespace strandcast::groom_abc_samples_test {
namespace {

using test::JsonValue;
using ::testing::AnyOf;
using ::testing::HasSubstr;

std::filesystem::path samples() {
  return test::shared_data() / "abc";
}

std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.path().extension() == ".abc") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

std::string whole_path(const AbcTree& tree, size_t node) {
  std::string path;
  for (std::optional<size_t> i = node; i && tree.nodes()[*i].parent; i = tree.nodes()[*i].parent)
    path = "/" + tree.nodes()[*i].object.name + path;
  return path;
}

std::vector<double> numbers_of(const AbcParam& param) {
  std::vector<double> numbers;
  for (size_t i = 0; i < param.count(); ++i)
    for (uint32_t axis = 0; axis < param.values.extent; ++axis) numbers.push_back(param.number(i, axis));
  return numbers;
}

/// Numbers of nine digits name one float each; those of double precision have seventeen.
void expect_numbers(const std::vector<double>& found, const std::vector<double>& expected, bool is_double) {
  ASSERT_EQ(found.size(), expected.size());
  for (size_t i = 0; i < found.size(); ++i)
    EXPECT_EQ(found[i], is_double ? expected[i] : static_cast<double>(static_cast<float>(expected[i]))) << i;
}

/// FNV-1a over bytes, as 16 digits; the samples' begins at another number than the usual one.
template <class T>
std::string fnv_of(const std::vector<T>& numbers) {
  uint64_t hash = 1469598103934665603ull;
  for (const std::byte byte : std::as_bytes(std::span(numbers)))
    hash = (hash ^ static_cast<uint64_t>(byte)) * 0x100000001b3ull;
  return fmt::format("{:016x}", hash);
}

void expect_matrix(const glm::dmat4& found, const JsonValue& expected) {
  ASSERT_EQ(expected.items.size(), 16u);
  for (int i = 0; i < 16; ++i)
    EXPECT_NEAR(found[i / 4][i % 4], expected.items[static_cast<size_t>(i)].number, 1e-12) << i;
}

void expect_param(const AbcCurvesReader& reader, const char* name, uint64_t sample, const JsonValue& frame) {
  const auto param = reader.param(name, sample);
  ASSERT_TRUE(param) << param.error().to_string();
  ASSERT_EQ(param->has_value(), frame.has(name)) << name;
  if (!param->has_value()) return;
  EXPECT_EQ((*param)->stated_scope, frame[name]["scope"].text);
  expect_numbers(numbers_of(**param), frame[name]["values"].numbers(), false);
  if (!frame[name].has("indices")) return;
  ASSERT_TRUE((*param)->indices);
  const std::vector<double> indices((*param)->indices->begin(), (*param)->indices->end());
  EXPECT_EQ(indices, frame[name]["indices"].numbers());
}

void expect_frame(const AbcCurvesReader& reader, uint64_t sample, const JsonValue& frame) {
  EXPECT_DOUBLE_EQ(reader.time_s(sample), frame["time"].number);
  const auto curves = reader.read(sample, kMaxStrandCount, kMaxGroomVertices);
  ASSERT_TRUE(curves) << curves.error().to_string();
  EXPECT_EQ(static_cast<double>(curves->vertex_counts.size()), frame["curves"].number);
  EXPECT_EQ(static_cast<double>(curves->points.size()), frame["points"].number);
  EXPECT_EQ(fnv_of(curves->points), frame["P_fnv1a64"].text);
  EXPECT_EQ(fnv_of(curves->vertex_counts), frame["nVertices_fnv1a64"].text);
  if (frame.has("P")) {
    std::vector<double> points;
    for (const glm::vec3& point : curves->points) points.insert(points.end(), {point.x, point.y, point.z});
    expect_numbers(points, frame["P"].numbers(), false);
  }
  for (const char* const name : {"width", "uv", "N"}) expect_param(reader, name, sample, frame);
  for (const auto& [name, key] :
       {std::pair("velocity", ".velocities"), {"knots", ".knots"}, {"orders", ".orders"}, {"w", "w"}}) {
    if (!frame.has(name)) continue;
    const auto param = reader.param(key, sample);
    ASSERT_TRUE(param && param->has_value()) << key;
    expect_numbers(numbers_of(**param), frame[name].numbers(), false);
  }
}

void expect_free_param(const AbcArchive& archive, const AbcCurvesReader& reader, const std::string& name,
                       const JsonValue& said) {
  const AbcProperty* const property = find_abc_property(reader.free_params(), name);
  ASSERT_NE(property, nullptr);
  EXPECT_EQ(abc_metadata_value(property->metadata, "geoScope"), said["scope"].text);
  EXPECT_EQ(abc_metadata_value(property->metadata, "interpretation"), said["interpretation"].text);
  for (size_t sample = 0; sample < said["samples"].items.size(); ++sample) {
    const JsonValue& expected = said["samples"].items[sample];
    if (said["pod"].text == "string") {
      const auto read = archive.sample(*property, sample, 1'000);
      ASSERT_TRUE(read) << read.error().to_string();
      std::vector<std::string> texts;
      for (const JsonValue& text : expected.items) texts.push_back(text.text);
      EXPECT_EQ(read->texts(), texts);
      continue;
    }
    const auto param = reader.param(name, sample);
    ASSERT_TRUE(param && param->has_value());
    EXPECT_EQ((*param)->values.extent, static_cast<uint32_t>(said["extent"].number));
    // Of an indexed parameter the samples are its values, without the indices.
    AbcParam stored = **param;
    stored.indices.reset();
    expect_numbers(numbers_of(stored), expected.numbers(), said["pod"].text == "float64_t");
    if (!said.has("indices")) continue;
    ASSERT_TRUE((*param)->indices);
    const std::vector<double> indices((*param)->indices->begin(), (*param)->indices->end());
    EXPECT_EQ(indices, said["indices"].numbers());
  }
}

void expect_user(const AbcArchive& archive, const AbcObject& object, const char* schema,
                 const JsonValue& said) {
  if (said.fields.empty()) return;
  const auto properties = archive.properties(object);
  ASSERT_TRUE(properties);
  const auto own = archive.properties(*find_abc_property(*properties, schema));
  ASSERT_TRUE(own);
  const auto user = archive.properties(*find_abc_property(*own, ".userProperties"));
  ASSERT_TRUE(user);
  EXPECT_EQ(user->size(), said.fields.size());
  for (const auto& [name, value] : said.fields) {
    const auto sample = archive.sample(*find_abc_property(*user, name), 0, 1'000);
    ASSERT_TRUE(sample) << sample.error().to_string();
    if (value["pod"].text == "string") {
      EXPECT_EQ(sample->texts(), std::vector<std::string>{value["value"].text}) << name;
    } else {
      EXPECT_EQ(sample->number(0), value["value"].number) << name;
    }
  }
}

void expect_curves(const AbcArchive& archive, const AbcTree& tree, size_t node, const JsonValue& said) {
  EXPECT_EQ(whole_path(tree, node), said["path"].text);
  const AbcObject& object = tree.nodes()[node].object;
  const auto reader = AbcCurvesReader::open(archive, object);
  ASSERT_TRUE(reader) << reader.error().to_string();
  EXPECT_EQ(static_cast<double>(reader->sample_count()), said["samples"].number);
  expect_user(archive, object, ".geom", said["user"]);
  EXPECT_EQ(reader->free_params().size(), said["arb"].fields.size());
  for (const auto& [name, param] : said["arb"].fields) {
    SCOPED_TRACE(name);
    expect_free_param(archive, *reader, name, param);
  }
  const std::array<std::string, 6> bases = {"none", "bezier", "bspline", "catmullrom", "hermite", "power"};
  const std::array<std::string, 3> types = {"cubic", "linear", "variable"};
  ASSERT_EQ(said["times"].items.size(), said["frames"].items.size());
  for (size_t sample = 0; sample < said["frames"].items.size(); ++sample) {
    SCOPED_TRACE(sample);
    const JsonValue& frame = said["frames"].items[sample];
    EXPECT_DOUBLE_EQ(reader->time_s(sample), said["times"].items[sample].number);
    expect_frame(*reader, sample, frame);
    const auto curves = reader->read(sample, kMaxStrandCount, kMaxGroomVertices);
    EXPECT_EQ(types[static_cast<size_t>(curves->type)], said["type"].text);
    EXPECT_EQ(bases[static_cast<size_t>(curves->basis)], said["basis"].text);
    EXPECT_EQ(curves->is_periodic, said["wrap"].text == "periodic");
    const auto world = tree.world_from_node(archive, node, reader->time_s(sample));
    ASSERT_TRUE(world) << world.error().to_string();
    expect_matrix(*world, frame["world_matrix"]);
  }
}

void expect_xform(const AbcArchive& archive, const AbcTree& tree, size_t node, const JsonValue& said) {
  EXPECT_EQ(whole_path(tree, node), said["path"].text);
  const AbcNode& found = tree.nodes()[node];
  EXPECT_EQ(found.xform->is_inheriting, said["inherits"].number == 1.0);
  expect_user(archive, found.object, ".xform", said["user"]);
  for (size_t sample = 0; sample < said["matrices"].items.size(); ++sample) {
    const auto matrix = abc_matrix(archive, *found.xform, sample);
    ASSERT_TRUE(matrix) << matrix.error().to_string();
    expect_matrix(*matrix, said["matrices"].items[sample]);
    if (found.xform->channels) {
      EXPECT_DOUBLE_EQ(archive.time_s(*found.xform->channels, sample), said["times"].items[sample].number);
    }
  }
}

TEST(AbcSamples, AllContentIsThatOfTheirJson) {
  REQUIRE_SHARED(samples());
  size_t curves_count = 0, xform_count = 0;
  const auto files = files_in(samples());
  EXPECT_EQ(files.size(), 44u);
  for (std::filesystem::path path : files) {
    SCOPED_TRACE(path.filename().string());
    auto container = AbcContainer::open(path);
    ASSERT_TRUE(container) << container.error().to_string();
    const auto archive = AbcArchive::read(std::move(*container));
    ASSERT_TRUE(archive) << archive.error().to_string();
    const auto tree = AbcTree::read(*archive);
    ASSERT_TRUE(tree) << tree.error().to_string();
    const auto text = load_text(path.replace_extension(".json"), 1 << 20);
    ASSERT_TRUE(text);
    const JsonValue said = test::JsonScan(*text).value();
    size_t curves = 0, xforms = 0, others = 0, instances = 0;
    for (size_t node = 1; node < tree->nodes().size(); ++node) {
      const AbcNode& found = tree->nodes()[node];
      // An instance is listed by its path alone, and its transform with the source.
      if (found.is_instance) {
        EXPECT_EQ(whole_path(*tree, node), said["instances"].items.at(instances++)["path"].text);
      } else if (found.kind == AbcKind::Curves) {
        expect_curves(*archive, *tree, node, said["curves"].items.at(curves++));
      } else if (found.kind == AbcKind::Xform) {
        // Not all groups that only hold others are listed.
        const auto& listed = said["xforms"].items;
        const auto same = std::find_if(listed.begin(), listed.end(), [&](const JsonValue& xform) {
          return xform["path"].text == whole_path(*tree, node);
        });
        if (same == listed.end()) continue;
        expect_xform(*archive, *tree, node, *same);
        ++xforms;
      } else {
        EXPECT_EQ(whole_path(*tree, node), said["others"].items.at(others++).text);
      }
    }
    EXPECT_EQ(curves, said["curves"].items.size());
    EXPECT_EQ(xforms, said["xforms"].items.size());
    EXPECT_EQ(others, said["others"].items.size());
    EXPECT_EQ(instances, said["instances"].items.size());
    curves_count += curves;
    xform_count += xforms;
  }
  EXPECT_GT(curves_count, 60u);
  EXPECT_GT(xform_count, 20u);
}

TEST(AbcSamples, KeysAreThoseThatWeWrite) {
  REQUIRE_SHARED(samples());
  size_t key_count = 0;
  for (const std::filesystem::path& path : files_in(samples())) {
    const auto container = AbcContainer::open(path);
    const auto archive = AbcArchive::read(*AbcContainer::open(path));
    const auto tree = AbcTree::read(*archive);
    ASSERT_TRUE(container && archive && tree);
    for (const AbcNode& node : tree->nodes()) {
      if (node.kind != AbcKind::Curves) continue;
      const auto of_object = archive->properties(node.object);
      const auto own = archive->properties(*find_abc_property(*of_object, ".geom"));
      for (const AbcProperty& property : *own) {
        if (property.kind == AbcPropertyKind::Compound) continue;
        const auto group = container->group(property.child);
        const auto children = container->children(*group, 1'000);
        const size_t step = property.kind == AbcPropertyKind::Array ? 2 : 1;
        for (size_t i = 0; i < children->size(); i += step) {
          const auto bytes = container->read(*container->block((*children)[i]), 1 << 20);
          ASSERT_TRUE(bytes) << bytes.error().to_string();
          if (bytes->empty()) continue;
          AbcKey key;
          std::memcpy(key.data(), bytes->data(), sizeof(key));
          EXPECT_EQ(key, murmur_key(std::span(*bytes).subspan(sizeof(key)))) << path << property.name;
          ++key_count;
        }
      }
    }
  }
  EXPECT_GT(key_count, 300u);
}

TEST(AbcSamples, GroomsHaveTheRootsUnrealNames) {
  REQUIRE_SHARED(samples());
  for (const char* const name : {"ue_groom.abc", "double_attrs.abc"}) {
    const auto groom = load_abc(samples() / name);
    ASSERT_TRUE(groom) << groom.error().to_string();
    // Of eight strands two are guides: numbers 0 and 4.
    EXPECT_EQ(groom->groom.strand_count(), 6u);
    const std::vector<glm::vec2> expected = {{0.1f, 0.95f}, {0.2f, 0.9f}, {0.3f, 0.85f},
                                             {0.5f, 0.75f}, {0.6f, 0.7f}, {0.7f, 0.65f}};
    ASSERT_EQ(groom->groom.root_uv.size(), expected.size());
    for (size_t i = 0; i < expected.size(); ++i)
      EXPECT_LT(glm::distance(groom->groom.root_uv[i], expected[i]), 1e-6f);
  }
  const auto blender = load_abc(samples() / "blender_particles.abc");
  ASSERT_TRUE(blender);
  EXPECT_EQ(blender->groom.root_uv.size(), blender->groom.strand_count()) << "its uv states no scope";
  const auto rounded = load_abc(samples() / "P_float64.abc");
  ASSERT_TRUE(rounded);
  EXPECT_THAT(rounded->notes, ::testing::Contains(HasSubstr("double precision")));
}

TEST(AbcSamples, DamagedOnesEndInASentenceOrASoundGroom) {
  REQUIRE_SHARED(samples());
  constexpr size_t kMostBytes = 64u << 20;  // of one allocation, for the list of 100,000 objects
  const auto files = files_in(samples() / "malformed");
  EXPECT_EQ(files.size(), 83u);
  const std::set<std::string> good = {
      "concatenated.abc",          "deep_1400.abc",          "frames_4e9.abc",       "instance_no_source.abc",
      "negative_width.abc",        "no_selfBnds.abc",        "points_left_over.abc", "sample_count_200.abc",
      "sample_count_unstored.abc", "string_missing_nul.abc", "trailing_garbage.abc", "width_count.abc"};
  for (const std::filesystem::path& path : files) {
    const std::string name = path.filename().string();
    SCOPED_TRACE(name);
    ASSERT_EQ(test::beyond_bounds([&] { (void)load_abc(path); }), "");
    test::reset_largest_allocation();
    const auto groom = load_abc(path);
    EXPECT_LE(test::largest_allocation_bytes(), kMostBytes);
    if (!name.starts_with("bitflip")) {
      EXPECT_EQ(groom.ok(), good.contains(name));
    }
    if (groom) {
      check_loaded_groom(groom->groom);
      continue;
    }
    EXPECT_EQ(groom.error().to_string().find('\n'), std::string::npos);
    EXPECT_THAT(groom.error().to_string(), HasSubstr(path.string()));
  }
  const auto refusal = [](const char* name) {
    return load_abc(samples() / "malformed" / name).error().to_string();
  };
  EXPECT_THAT(refusal("hdf5.abc"), HasSubstr("HDF5"));
  EXPECT_THAT(refusal("not_frozen.abc"), HasSubstr("did not finish"));
  EXPECT_THAT(refusal("object_loop_2.abc"), HasSubstr("objects in each other, more than"));
  EXPECT_THAT(refusal("shared_children_2_40.abc"), HasSubstr("more than 100000 objects"));
  EXPECT_THAT(refusal("count_sum_wraps.abc"), AnyOf(HasSubstr("strand 0"), HasSubstr("need")));
  EXPECT_THAT(refusal("xform_op_15.abc"), HasSubstr("unknown operation 15"));
}

}  // namespace
}  // namespace strandcast::groom_abc_samples_test
