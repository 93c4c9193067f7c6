#include "common/groom/abc_tree.h"

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>

#include "common/groom/text_scan.h"

namespace strandcast {
namespace {

constexpr std::string_view kXformProperty = ".xform";
enum class XformOp : uint8_t { Scale, Translate, Rotate, Matrix, RotateX, RotateY, RotateZ };
constexpr uint32_t kOpTypeShift = 4;   // hints stand below: they name pivots
constexpr int kMostInstanceSteps = 8;  // an instance of an instance
constexpr size_t kMostPathNames = 12, kMostPathChars = 80;

AbcKind kind_of_object(const AbcObject& object) {
  const std::string_view schema = abc_metadata_value(object.metadata, "schema");
  if (schema.starts_with("AbcGeom_Xform_")) return AbcKind::Xform;
  if (schema.starts_with("AbcGeom_Curve_")) return AbcKind::Curves;
  return AbcKind::Other;
}

size_t channel_count(XformOp op) {
  switch (op) {
    case XformOp::Scale:
    case XformOp::Translate:
      return 3;
    case XformOp::Rotate:
      return 4;
    case XformOp::Matrix:
      return 16;
    case XformOp::RotateX:
    case XformOp::RotateY:
    case XformOp::RotateZ:
      return 1;
  }
  return 0;
}

glm::dmat4 op_matrix(XformOp op, const std::vector<double>& value) {
  const glm::dmat4 one(1.0);
  switch (op) {
    case XformOp::Scale:
      return glm::scale(one, glm::dvec3(value[0], value[1], value[2]));
    case XformOp::Translate:
      return glm::translate(one, glm::dvec3(value[0], value[1], value[2]));
    case XformOp::Rotate: {
      const glm::dvec3 axis(value[0], value[1], value[2]);
      return glm::length(axis) > 0.0 ? glm::rotate(one, glm::radians(value[3]), axis) : one;
    }
    case XformOp::Matrix: {
      // Rows are what a row vector is multiplied with: columns here.
      glm::dmat4 matrix;
      for (int i = 0; i < 16; ++i) matrix[i / 4][i % 4] = value[static_cast<size_t>(i)];
      return matrix;
    }
    case XformOp::RotateX:
    case XformOp::RotateY:
    case XformOp::RotateZ: {
      glm::dvec3 axis(0.0);
      axis[static_cast<int>(op) - static_cast<int>(XformOp::RotateX)] = 1.0;
      return glm::rotate(one, glm::radians(value[0]), axis);
    }
  }
  return one;
}

Result<AbcXform> read_xform(const AbcArchive& archive, const std::vector<AbcProperty>& of_object) {
  AbcXform xform;
  const AbcProperty* const compound = find_abc_property(of_object, kXformProperty);
  if (compound == nullptr) return xform;
  ASSIGN_OR_RETURN(const auto properties, archive.properties(*compound));
  if (const AbcProperty* inherits = find_abc_property(properties, ".inherits"); inherits != nullptr) {
    ASSIGN_OR_RETURN(const AbcSample sample, archive.sample(*inherits, 0, 1));
    xform.is_inheriting = sample.count() == 0 || sample.number(0) != 0.0;
  }
  const AbcProperty* const ops = find_abc_property(properties, ".ops");
  if (ops == nullptr) return xform;
  ASSIGN_OR_RETURN(const AbcSample sample, archive.sample(*ops, 0, kMaxAbcXformOps));
  const size_t count = sample.count() * sample.extent;
  if (ops->pod != AbcPod::U8 || count > kMaxAbcXformOps)
    return make_error(ErrorCode::BadInput, "its transform has {} operations of element type {}", count,
                      static_cast<int>(ops->pod));
  for (const std::byte op : sample.bytes) xform.ops.push_back(static_cast<uint8_t>(op));
  if (const AbcProperty* channels = find_abc_property(properties, ".vals"); channels != nullptr)
    xform.channels = *channels;
  return xform;
}

/// Whether an object is shown: its own word, else its parent's.
Result<bool> read_visible(const AbcArchive& archive, const std::vector<AbcProperty>& properties,
                          bool is_parent_visible) {
  const AbcProperty* const visible = find_abc_property(properties, "visible");
  if (visible == nullptr || visible->kind != AbcPropertyKind::Scalar) return is_parent_visible;
  ASSIGN_OR_RETURN(const AbcSample sample, archive.sample(*visible, 0, 1));
  const double said = sample.count() == 0 ? -1.0 : sample.number(0);
  return said < 0.0 ? is_parent_visible : said > 0.0;
}

/// The path of the object that an instance stands for; empty if it names none.
Result<std::string> source_path(const AbcArchive& archive, const AbcObject& instance) {
  ASSIGN_OR_RETURN(const auto properties, archive.properties(instance));
  const AbcProperty* const source = find_abc_property(properties, ".instanceSource");
  if (source == nullptr || source->pod != AbcPod::String) return std::string();
  ASSIGN_OR_RETURN(const AbcSample sample, archive.sample(*source, 0, kMaxAbcNameBytes * kMaxAbcDepth));
  std::vector<std::string> texts = sample.texts();
  return texts.empty() ? std::string() : std::move(texts.front());
}

/// The object at a path; empty if it is not there.
Result<std::optional<AbcObject>> find_object(const AbcArchive& archive, std::string_view path) {
  if (path.empty()) return std::optional<AbcObject>();
  AbcObject object = archive.top();
  while (!path.empty()) {
    path.remove_prefix(path.front() == '/' ? 1 : 0);
    const std::string_view name = path.substr(0, path.find('/'));
    path.remove_prefix(name.size());
    ASSIGN_OR_RETURN(auto objects, archive.objects(object));
    const auto found =
        std::find_if(objects.begin(), objects.end(), [&](const AbcObject& o) { return o.name == name; });
    if (found == objects.end()) return std::optional<AbcObject>();
    object = std::move(*found);
  }
  return std::optional(std::move(object));
}

}  // namespace

Result<glm::dmat4> abc_matrix(const AbcArchive& archive, const AbcXform& xform, uint64_t sample) {
  glm::dmat4 matrix(1.0);
  std::vector<double> channels;
  if (xform.channels) {
    constexpr uint64_t kMostChannels = kMaxAbcXformOps * 16;
    ASSIGN_OR_RETURN(const AbcSample values, archive.sample(*xform.channels, sample, kMostChannels));
    for (size_t i = 0; i < values.count(); ++i)
      for (uint32_t axis = 0; axis < values.extent; ++axis) channels.push_back(values.number(i, axis));
  }
  size_t first = 0;
  for (const uint8_t byte : xform.ops) {
    const auto op = static_cast<XformOp>(byte >> kOpTypeShift);
    if (op > XformOp::RotateZ)
      return make_error(ErrorCode::BadInput, "its transform has the unknown operation {}",
                        byte >> kOpTypeShift);
    const size_t count = channel_count(op);
    if (count > channels.size() - first)
      return make_error(ErrorCode::BadInput, "its transform needs more than the {} numbers that it has",
                        channels.size());
    const auto begin = channels.begin() + static_cast<std::ptrdiff_t>(first);
    matrix = matrix * op_matrix(op, {begin, begin + static_cast<std::ptrdiff_t>(count)});
    first += count;
  }
  return matrix;
}

Result<AbcTree> AbcTree::read(const AbcArchive& archive) {
  AbcTree tree;
  AbcNode top;
  top.object = archive.top();
  top.world_from_node = glm::dmat4(1.0);
  tree.nodes_.push_back(std::move(top));
  // What is still to be read, the next one last. The top object's own properties do not matter.
  std::vector<AbcNode> waiting;
  size_t parent = 0;
  while (true) {
    const AbcNode& node = tree.nodes_[parent];
    auto objects = archive.objects(node.object);
    if (!objects) return at(tree.path(parent), objects.error());
    if (tree.nodes_.size() + waiting.size() + objects->size() > kMaxAbcObjects)
      return make_error(ErrorCode::LimitExceeded, "more than {} objects", kMaxAbcObjects);
    if (node.depth == kMaxAbcDepth && !objects->empty())
      return make_error(ErrorCode::LimitExceeded, "objects in each other, more than {}", kMaxAbcDepth);
    for (auto object = objects->rbegin(); object != objects->rend(); ++object) {
      AbcNode& next = waiting.emplace_back();
      next.parent = parent;
      next.depth = node.depth + 1;
      next.object = std::move(*object);
    }
    const size_t known = tree.nodes_.size();
    while (tree.nodes_.size() == known) {
      if (waiting.empty()) return tree;
      AbcNode next = std::move(waiting.back());
      waiting.pop_back();
      const size_t above = *next.parent;
      const std::string name = next.object.name;
      if (const Status added = tree.add(archive, std::move(next)); !added)
        return at(tree.path(above) + "/" + one_line(name, kMostPathChars), added.error());
    }
    parent = known;
  }
}

Status AbcTree::add(const AbcArchive& archive, AbcNode node) {
  for (int step = 0; abc_metadata_value(node.object.metadata, "isInstance") == "1"; ++step) {
    ASSIGN_OR_RETURN(const std::string path, source_path(archive, node.object));
    const auto [source, is_new] = sources_.try_emplace(path);
    if (is_new) {
      ASSIGN_OR_RETURN(source->second, find_object(archive, path));
    }
    if (!source->second || step == kMostInstanceSteps) {
      ++lost_instance_count_;
      return {};
    }
    std::string name = std::move(node.object.name);
    node.object = *source->second;
    node.object.name = std::move(name);
    node.is_instance = true;
  }
  node.kind = kind_of_object(node.object);
  ASSIGN_OR_RETURN(const auto properties, archive.properties(node.object));
  const AbcNode& parent = nodes_[*node.parent];
  ASSIGN_OR_RETURN(node.is_visible, read_visible(archive, properties, parent.is_visible));
  node.world_from_node = parent.world_from_node;
  if (node.kind == AbcKind::Xform) {
    ASSIGN_OR_RETURN(node.xform, read_xform(archive, properties));
    const bool moves = node.xform->channels && node.xform->channels->sample_count > 1 &&
                       node.xform->channels->last_changed > 0;
    ASSIGN_OR_RETURN(const glm::dmat4 own, abc_matrix(archive, *node.xform, 0));
    const std::optional<glm::dmat4> above =
        node.xform->is_inheriting ? parent.world_from_node : glm::dmat4(1.0);
    node.world_from_node.reset();
    if (above && !moves) node.world_from_node = *above * own;
  }
  nodes_.push_back(std::move(node));
  return {};
}

std::string AbcTree::path(size_t node) const {
  std::string path;
  size_t names = 0;
  for (std::optional<size_t> i = node; i && nodes_[*i].parent; i = nodes_[*i].parent) {
    if (++names > kMostPathNames) return path.insert(0, "...");
    path.insert(0, one_line(nodes_[*i].object.name, kMostPathChars)).insert(0, "/");
  }
  return path;
}

Result<glm::dmat4> AbcTree::world_from_node(const AbcArchive& archive, size_t node, double time_s) const {
  glm::dmat4 world(1.0);
  for (std::optional<size_t> i = node; i; i = nodes_[*i].parent) {
    const AbcNode& above = nodes_[*i];
    if (above.world_from_node) return *above.world_from_node * world;
    if (!above.xform) continue;
    const AbcXform& xform = *above.xform;
    const uint64_t sample = xform.channels ? archive.nearest_sample(*xform.channels, time_s) : 0;
    ASSIGN_OR_RETURN(const glm::dmat4 own, abc_matrix(archive, xform, sample));
    world = own * world;
    if (!xform.is_inheriting) break;
  }
  return world;
}

}  // namespace strandcast
