"""Our own Modbus master: registers by name and in engineering units, uploads, refusals in words."""
