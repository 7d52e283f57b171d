// SPDX-License-Identifier: Apache-2.0
#include "tests/offload/landmarks/onnx_writer.h"

#include <cstring>
#include <fstream>

namespace gyre {

namespace {

// The wire format of Protocol Buffers: fields are a tag and a varint or length-delimited bytes.
class Message {
 public:
  Message& number(int field, std::uint64_t value) {
    varint(static_cast<std::uint64_t>(field) << 3U);
    varint(value);
    return *this;
  }
  Message& bytes(int field, const std::string& content) {
    varint(static_cast<std::uint64_t>(field) << 3U | 2U);
    varint(content.size());
    data_ += content;
    return *this;
  }
  Message& message(int field, const Message& content) { return bytes(field, content.data_); }
  const std::string& data() const { return data_; }

 private:
  void varint(std::uint64_t value) {
    for (; value >= 0x80; value >>= 7U) data_ += static_cast<char>(value | 0x80U);
    data_ += static_cast<char>(value);
  }
  std::string data_;
};

// The fields of onnx.proto3 that are used: TensorProto, ValueInfoProto, AttributeProto, NodeProto, GraphProto,
// ModelProto.
template <class T>
Message tensor(const std::string& name, const std::vector<std::int64_t>& shape, int type,
               const std::vector<T>& values) {
  Message m;
  for (const std::int64_t d : shape) m.number(1, static_cast<std::uint64_t>(d));
  std::string raw(values.size() * sizeof(T), '\0');
  std::memcpy(raw.data(), values.data(), raw.size());
  return m.number(2, type).bytes(8, name).bytes(9, raw);
}
Message floats(const std::string& name, const std::vector<std::int64_t>& shape, const std::vector<float>& values) {
  return tensor(name, shape, 1, values);
}
Message integers(const std::string& name, const std::vector<std::int64_t>& values) {
  return tensor(name, {static_cast<std::int64_t>(values.size())}, 7, values);
}

Message value_info(const std::string& name, const std::vector<std::int64_t>& shape) {
  Message dims;
  for (const std::int64_t d : shape) dims.message(1, Message().number(1, static_cast<std::uint64_t>(d)));
  const Message type = Message().message(1, Message().number(1, 1).message(2, dims));
  return Message().bytes(1, name).message(2, type);
}

Message node(const std::string& type, const std::vector<std::string>& inputs, const std::string& output) {
  Message m;
  for (const std::string& input : inputs) m.bytes(1, input);
  return m.bytes(2, output).bytes(3, type + "_" + output).bytes(4, type);
}

Message kernel_of_one() {
  Message attribute;
  attribute.bytes(1, "kernel_shape").number(8, 1).number(8, 1).number(20, 7);
  return attribute;
}

void write_model(const std::filesystem::path& file, const Message& graph) {
  const Message model =
      Message().number(1, 7).bytes(2, "gyre-test").message(7, graph).message(8, Message().bytes(1, "").number(2, 11));
  std::ofstream(file, std::ios::binary) << model.data();
}

}  // namespace

void write_constant_network(const std::filesystem::path& file, int width, int height,
                            const std::vector<ConstantOutput>& outputs) {
  Message graph;
  graph.message(1, node("GlobalAveragePool", {"image"}, "mean"));
  for (const ConstantOutput& output : outputs) {
    Message convolution = node("Conv", {"mean", output.name + "_w", output.name + "_b"}, output.name + "_flat");
    convolution.message(5, kernel_of_one());
    graph.message(1, convolution);
    graph.message(1, node("Reshape", {output.name + "_flat", output.name + "_shape"}, output.name));
  }
  graph.bytes(2, "constant");
  for (const ConstantOutput& output : outputs) {
    const auto count = static_cast<std::int64_t>(output.values.size());
    graph.message(5, floats(output.name + "_w", {count, 3, 1, 1}, std::vector<float>(3 * count, 0.0F)));
    graph.message(5, floats(output.name + "_b", {count}, output.values));
    graph.message(5, integers(output.name + "_shape", output.shape));
  }
  graph.message(11, value_info("image", {1, 3, height, width}));
  for (const ConstantOutput& output : outputs) graph.message(12, value_info(output.name, output.shape));
  write_model(file, graph);
}

void write_colour_network(const std::filesystem::path& file, int width, int height,
                          const std::vector<ColourFilter>& filters) {
  const auto count = static_cast<std::int64_t>(filters.size());
  std::vector<float> weights, biases;
  for (const ColourFilter& filter : filters) {
    weights.insert(weights.end(), filter.weights, filter.weights + 3);
    biases.push_back(filter.bias);
  }
  Message graph, convolution = node("Conv", {"image", "w", "b"}, "heat");
  convolution.message(5, kernel_of_one());
  graph.message(1, convolution);
  graph.bytes(2, "colours");
  graph.message(5, floats("w", {count, 3, 1, 1}, weights));
  graph.message(5, floats("b", {count}, biases));
  graph.message(11, value_info("image", {1, 3, height, width}));
  graph.message(12, value_info("heat", {1, count, height, width}));
  write_model(file, graph);
}

}  // namespace gyre
