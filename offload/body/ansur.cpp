// SPDX-License-Identifier: Apache-2.0
#include "offload/body/ansur.h"

#include "common/bundle/atomic_file.h"

#include <charconv>

namespace gyre {
namespace {

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream stream(line);
  std::string cell;
  while (std::getline(stream, cell, ',')) {
    while (!cell.empty() && (cell.back() == '\r' || cell.back() == ' ')) cell.pop_back();
    cells.push_back(cell);
  }
  return cells;
}

// A positive number in a cell; empty for anything else.
std::optional<double> number(const std::vector<std::string>& cells, std::size_t at) {
  double value = 0;
  if (at >= cells.size()) return std::nullopt;
  const char *begin = cells[at].data(), *end = begin + cells[at].size();
  if (std::from_chars(begin, end, value).ec != std::errc() || !(value > 0)) return std::nullopt;
  return value;
}

Result<Survey::Sex> read_table(const std::filesystem::path& file) {
  const Result<std::string> text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  std::istringstream lines(*text);
  std::string line;
  std::getline(lines, line);
  const std::vector<std::string> header = split(line);
  std::array<std::size_t, survey_measures.size() + 1> at{};
  for (std::size_t c = 0; c < at.size(); ++c) {
    const std::string name(c < survey_measures.size() ? survey_measures[c] : "Age");
    at[c] = std::find(header.begin(), header.end(), name) - header.begin();
    if (at[c] == header.size()) return fail("table without column '" + name + "'", file.string());
  }
  Survey::Sex sex;
  for (int row = 2; std::getline(lines, line); ++row) {
    const std::vector<std::string> cells = split(line);
    Person person;
    for (std::size_t c = 0; c < at.size(); ++c) {
      const std::optional<double> value = number(cells, at[c]);
      if (!value) return fail("bad number", file.string() + " line " + std::to_string(row));
      (c < survey_measures.size() ? person.measures[c] : person.age) =
          c < survey_measures.size() ? *value / 1000 : *value;
    }
    sex.people.push_back(person);
  }
  if (sex.people.size() < 100) return fail("table with too few people", file.string());
  const auto count = static_cast<double>(sex.people.size());
  for (std::size_t m = 0; m < survey_measures.size(); ++m) {
    double sum = 0, squares = 0;
    for (const Person& person : sex.people) sum += person.measures[m];
    sex.mean[m] = sum / count;
    for (const Person& person : sex.people) squares += std::pow(person.measures[m] - sex.mean[m], 2);
    sex.deviation[m] = std::sqrt(squares / (count - 1));
  }
  return sex;
}

}  // namespace

Result<Survey> read_survey(const std::filesystem::path& folder) {
  Result<Survey::Sex> female = read_table(folder / "ansur2_female_measures.csv");
  if (!female) return tl::unexpected(female.error());
  Result<Survey::Sex> male = read_table(folder / "ansur2_male_measures.csv");
  if (!male) return tl::unexpected(male.error());
  return Survey{std::move(*female), std::move(*male)};
}

}  // namespace gyre
