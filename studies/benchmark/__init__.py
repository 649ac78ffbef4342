"""The benchmark's runs with Optuna's samplers among the methods, its tables and figures."""
