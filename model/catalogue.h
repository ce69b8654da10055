/// @file
/// Types of one family by name, with their parameters by name: friction laws, effects.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>

namespace model {

struct ParameterDescription {
  std::string_view name;  ///< ends with its unit
  double lower;
  double upper;
  double initial;  ///< the default, where a fit may start
};
struct NamedValue {
  std::string_view name;
  double value;
};

/// A member T of the variant has kName, Parameters with defaults and kParameters (friction/law.h), and is
/// constructed from Parameters, which it checks. `Kind::kName`: name of the family in messages.
template <class Kind, class Variant>
class Catalogue;

template <class Kind, class... Ts>
class Catalogue<Kind, std::variant<Ts...>> {
 public:
  /// Valid for the lifetime of the program.
  template <class T>
  static std::span<const ParameterDescription> parameters_of() {
    static const auto kDescriptions = [] {
      std::array<ParameterDescription, T::kParameters.size()> result{};
      const typename T::Parameters defaults;
      std::transform(T::kParameters.begin(), T::kParameters.end(), result.begin(), [&](const auto& info) {
        return ParameterDescription{info.name, info.lower, info.upper, info.of(defaults)};
      });
      return result;
    }();
    return kDescriptions;
  }

  /// Calls `visit` with a null pointer to each type, as a type tag.
  template <class Visit>
  static void for_each(const Visit& visit) {
    (visit(static_cast<const Ts*>(nullptr)), ...);
  }

  /// The member of `descriptions` with that name. @throws std::invalid_argument listing all names.
  template <class Description>
  static const Description& find(std::span<const Description> descriptions, std::string_view name) {
    const auto found = std::ranges::find(descriptions, name, &Description::name);
    if (found == descriptions.end())
      throw std::invalid_argument("there is no " + std::string(Kind::kName) + " " + std::string(name) +
                                  "; there are " + names_of(descriptions));
    return *found;
  }

  /// @throws std::invalid_argument listing the parameters if `parameter` is unknown.
  template <class T>
  static double parameter(const T& of, std::string_view parameter) {
    double value = 0;
    with_parameter<T>(parameter, [&](const auto& info) { value = info.of(of.parameters()); });
    return value;
  }
  template <class T>
  static void set(typename T::Parameters& parameters, std::string_view parameter, double value) {
    with_parameter<T>(parameter, [&](const auto& info) { info.in(parameters) = value; });
  }

  /// `fill(type, parameters)` changes the defaults of the type called `name`; empty if there is no such type.
  template <class Made, class Fill>
  static std::optional<Made> make(std::string_view name, const Fill& fill) {
    std::optional<Made> result;
    for_each([&]<class T>(const T* type) {
      if (T::kName != name) return;
      typename T::Parameters parameters;
      fill(type, parameters);
      result.emplace(T(parameters));
    });
    return result;
  }

 private:
  template <class Items>
  static std::string names_of(const Items& items) {
    std::string list;
    for (const auto& item : items) (list += list.empty() ? "" : ", ") += item.name;
    return list.empty() ? "none" : list;
  }
  template <class T, class Use>
  static void with_parameter(std::string_view parameter, const Use& use) {
    for (const auto& info : T::kParameters)
      if (info.name == parameter) return use(info);
    throw std::invalid_argument(std::string(Kind::kName) + " " + std::string(T::kName) + ": parameter " +
                                std::string(parameter) + " is unknown; it has " + names_of(T::kParameters));
  }
};

}  // namespace model
