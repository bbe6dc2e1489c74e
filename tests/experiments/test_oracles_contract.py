"""Every oracle keeps the contract."""

import pytest

from experiments import oracles
from tests.contracts.oracle_contract import OracleContract


@pytest.mark.parametrize("name", oracles.names())
class TestEveryOracle(OracleContract):
    pass
