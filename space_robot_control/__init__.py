"""Flight software: control laws, controller, navigation, allocation and guidance."""
