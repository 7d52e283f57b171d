// SPDX-License-Identifier: Apache-2.0
#include "common/config/config.h"

#include <toml++/toml.h>
#include <CLI/CLI.hpp>
#include <iterator>
#include <string>
#include <string_view>

namespace gyre {

namespace {

std::string text_of(const toml::node& value) {
  if (const auto* text = value.as_string()) return text->get();
  std::ostringstream out;
  value.visit([&](const auto& v) {
    if constexpr (toml::is_value<decltype(v)>) out << v;
  });
  return out.str();
}

// Line of the first character beyond ASCII outside quotes and comments, where TOML allows none; 0 when there is none.
// toml++ 3.3 takes some of them for impossible and then does anything.
int line_of_foreign_letter(std::string_view text) {
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  int line = 1;
  std::string_view quote;  // that closes the string we are in
  bool comment = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '\n') {
      ++line;
      comment = false;
      if (quote.size() == 1) quote = {};
    } else if (comment) {
      continue;
    } else if (!quote.empty()) {
      if (c == '\\' && quote.front() == '"') {
        ++i;
      } else if (text.substr(i).starts_with(quote)) {
        i += quote.size() - 1;
        quote = {};
      }
    } else if (c == '#') {
      comment = true;
    } else if (c == '"' || c == '\'') {
      const std::string_view triple = c == '"' ? R"(""")" : "'''";
      quote = text.substr(i).starts_with(triple) ? triple : triple.substr(0, 1);
      i += quote.size() - 1;
    } else if (static_cast<unsigned char>(c) >= 0x80) {
      return line;
    }
  }
  return 0;
}

class TomlConfig : public CLI::Config {
 public:
  std::string to_config(const CLI::App*, bool, bool, std::string) const override { return {}; }

  std::vector<CLI::ConfigItem> from_config(std::istream& in) const override {
    std::vector<CLI::ConfigItem> found;
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    if (const int line = line_of_foreign_letter(text); line > 0) {
      throw CLI::FileError("the configuration is not valid TOML: a letter beyond ASCII without quotes at line " +
                           std::to_string(line));
    }
    try {
      append(toml::parse(text), {}, found);
    } catch (const toml::parse_error& e) {
      std::ostringstream where;
      where << e.description() << " at line " << e.source().begin.line;
      throw CLI::FileError("the configuration is not valid TOML: " + where.str());
    }
    return found;
  }

 private:
  static void append(const toml::table& table, const std::vector<std::string>& parents,
                     std::vector<CLI::ConfigItem>& found) {
    for (const auto& [key, value] : table) {
      if (const toml::table* inner = value.as_table()) {
        std::vector<std::string> path = parents;
        path.emplace_back(key.str());
        append(*inner, path, found);
        continue;
      }
      CLI::ConfigItem item;
      item.parents = parents;
      item.name = key.str();
      if (const toml::array* list = value.as_array()) {
        for (const toml::node& element : *list) item.inputs.push_back(text_of(element));
      } else {
        item.inputs.push_back(text_of(value));
      }
      found.push_back(std::move(item));
    }
  }
};

}  // namespace

void add_config_option(CLI::App& app, const std::string& fallback) {
  app.set_config("--config", fallback, "TOML file with the same names as the flags (a flag wins)");
  app.config_formatter(std::make_shared<TomlConfig>());
  app.allow_config_extras(CLI::config_extras_mode::error);
}

}  // namespace gyre
